#include "peer.hpp"

#include <cmath>

namespace
{

constexpr double RIDGE = 1e-5;
constexpr double HUBER_MM = 60;
constexpr double OVERSHOOT_MM = 200;
constexpr size_t SAMPLES_MIN = 16;

using matrix = Eigen::MatrixXd; /* too large for Eigen's fixed sizes */
using vector = Eigen::Matrix<double, PEER_TERMS, 1>;

/* Rows of the basis at places (x, y) in field units. */
void fill_basis(const Eigen::ArrayXd &x, const Eigen::ArrayXd &y, peer_basis &basis)
{
    basis.resize(x.size(), PEER_TERMS);
    for (int row = 0; row < PEER_CENTRES; row++) {
        Eigen::ArrayXd dy2 = (y - peer_centre_place(row)).square() + 1;
        for (int column = 0; column < PEER_CENTRES; column++) {
            basis.col(row * PEER_CENTRES + column) =
                ((x - peer_centre_place(column)).square() + dy2).sqrt();
        }
    }
}

struct problem {
    peer_basis basis, weighted;
    Eigen::VectorXd off_mm, root_weight;
    matrix normal; /* the lower half, without ridge */
    vector right;
};

void assemble(problem &q)
{
    q.weighted = q.root_weight.asDiagonal() * q.basis;
    q.normal.setZero(PEER_TERMS, PEER_TERMS);
    q.normal.selfadjointView<Eigen::Lower>().rankUpdate(q.weighted.transpose());
    q.right = q.weighted.transpose() * (q.root_weight.cwiseProduct(q.off_mm));
}

bool solve(const problem &q, vector &coefficients)
{
    static matrix ridged;
    static Eigen::LLT<matrix, Eigen::Lower> factor;
    ridged = q.normal;
    ridged.diagonal() *= 1 + RIDGE;
    factor.compute(ridged);
    if (factor.info() != Eigen::Success) {
        return false;
    }
    coefficients = factor.solve(q.right);
    return true;
}

/* Root weights after the Huber step, and whose changed. */
std::vector<int> reweigh(const problem &q, const vector &coefficients, Eigen::VectorXd &root_weight)
{
    Eigen::VectorXd residual = q.basis * coefficients - q.off_mm;
    std::vector<int> changed;
    root_weight = q.root_weight;
    for (int i = 0; i < residual.size(); i++) {
        if (std::abs(residual[i]) > HUBER_MM) {
            root_weight[i] *= std::sqrt(HUBER_MM / std::abs(residual[i]));
            changed.push_back(i);
        }
    }
    return changed;
}

/* Take away what the changed rows weigh less now. */
void update(problem &q, const std::vector<int> &changed, const Eigen::VectorXd &root_weight)
{
    peer_basis less(changed.size(), PEER_TERMS);
    Eigen::VectorXd less_mm(changed.size());
    for (size_t i = 0; i < changed.size(); i++) {
        int from = changed[i], to = static_cast<int>(i);
        double root = std::sqrt(q.root_weight[from] * q.root_weight[from] -
                                root_weight[from] * root_weight[from]);
        less.row(to) = root * q.basis.row(from);
        less_mm[to] = root * q.off_mm[from];
    }
    q.normal.selfadjointView<Eigen::Lower>().rankUpdate(less.transpose(), -1.0);
    q.right.noalias() -= less.transpose() * less_mm;
    q.root_weight = root_weight;
}

} // namespace

double peer_node_place(int node)
{
    return (node - (PEER_NODES - 1) / 2) * 10.0 / 11.0;
}

double peer_centre_place(int centre)
{
    return (2 * centre - (PEER_CENTRES - 1)) * 20.0 / (PEER_CENTRES - 1);
}

void peer_begin(peer &p, peer_kind kind, const peer_rig &rig)
{
    p.kind = kind;
    p.rig = rig;
    p.points.resize(PEER_SLOTS);
    p.has_head = false;
    Eigen::ArrayXd x(PEER_NODES * PEER_NODES), y(PEER_NODES * PEER_NODES);
    for (int i = 0; i < PEER_NODES * PEER_NODES; i++) {
        x[i] = peer_node_place(i % PEER_NODES);
        y[i] = peer_node_place(i / PEER_NODES);
    }
    fill_basis(x, y, p.node_basis);
}

void peer_fit_surface(peer &p)
{
    static problem q;
    static Eigen::VectorXd root_weight;
    int count = static_cast<int>(p.samples.size());
    Eigen::ArrayXd x(count), y(count);
    p.has_surface = false;
    if (p.samples.size() < SAMPLES_MIN) {
        return;
    }
    q.off_mm.resize(count);
    q.root_weight.resize(count);
    for (int i = 0; i < count; i++) {
        const peer_sample &sample = p.samples[static_cast<size_t>(i)];
        x[i] = sample.x;
        y[i] = sample.y;
        q.off_mm[i] = sample.depth_mm;
        q.root_weight[i] = sample.root_weight;
    }
    double mean_mm = q.off_mm.mean();
    q.off_mm.array() -= mean_mm;
    fill_basis(x, y, q.basis);
    vector coefficients;
    assemble(q);
    if (!solve(q, coefficients)) {
        return;
    }
    std::vector<int> changed = reweigh(q, coefficients, root_weight);
    if (!changed.empty()) {
        if (p.kind == peer_kind::a) {
            q.root_weight = root_weight;
            assemble(q);
        } else {
            update(q, changed, root_weight);
        }
        if (!solve(q, coefficients)) {
            return;
        }
    }
    Eigen::Map<Eigen::VectorXd>(p.surface_mm.data(), PEER_NODES * PEER_NODES).noalias() =
        p.node_basis * coefficients;
    p.surface_mm =
        (p.surface_mm.array() + mean_mm).max(std::max(p.nearest_sample_mm - OVERSHOOT_MM, 1.0));
    p.nearest_node_mm = p.surface_mm.minCoeff();
    p.has_surface = true;
}
