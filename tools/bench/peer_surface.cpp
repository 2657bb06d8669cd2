#include "peer.hpp"

#include <cmath>

namespace
{

constexpr double RIDGE = 1e-5;
constexpr double HUBER_MM = 60;
constexpr double OVERSHOOT_MM = 200;
constexpr size_t SAMPLES_MIN = 16;
constexpr int CENTRES_STEPS = 48;

using vector = Eigen::Matrix<double, PEER_TERMS, 1>;

/* Rows of the basis at positions (x, y) in field units. */
void fill_basis(const Eigen::ArrayXd &x, const Eigen::ArrayXd &y, peer_basis &basis)
{
    basis.resize(x.size(), PEER_TERMS);
    for (int row = 0; row < PEER_CENTRES; row++) {
        Eigen::ArrayXd dy2 = (y - peer_centre_position(row)).square() + 1;
        for (int column = 0; column < PEER_CENTRES; column++) {
            basis.col(row * PEER_CENTRES + column) =
                ((x - peer_centre_position(column)).square() + dy2).sqrt();
        }
    }
}

struct problem {
    peer_basis basis;
    Eigen::VectorXd off_mm, root_weight, residual_mm;
    vector coefficients;
};

/* The normal equations, in A's double or in B's float. */
template <typename real> struct equations {
    using matrix = Eigen::Matrix<real, PEER_TERMS, PEER_TERMS>;
    using rows = Eigen::Matrix<real, Eigen::Dynamic, PEER_TERMS>;
    rows weighted;
    matrix normal, ridged; /* the lower half */
    Eigen::LLT<Eigen::Ref<matrix>, Eigen::Lower> factor{ridged};
};

template <typename real> void assemble(const problem &q, equations<real> &e)
{
    e.weighted = (q.root_weight.asDiagonal() * q.basis).template cast<real>();
    e.normal.setZero();
    e.normal.template selfadjointView<Eigen::Lower>().rankUpdate(e.weighted.transpose());
}

template <typename real> bool factorise(equations<real> &e)
{
    e.ridged = e.normal;
    e.ridged.diagonal() *= static_cast<real>(1 + RIDGE);
    e.factor.compute(e.ridged);
    return e.factor.info() == Eigen::Success;
}

/* The Huber step: what is farther off than that is moved to it, of which the matrix knows nothing. */
bool move(problem &q)
{
    const Eigen::VectorXd beyond_mm =
        q.residual_mm - q.residual_mm.cwiseMax(-HUBER_MM).cwiseMin(HUBER_MM);
    q.off_mm -= beyond_mm;
    q.residual_mm -= beyond_mm;
    return !beyond_mm.isZero(0);
}

/* Peer A: solved in double. */
void solve_directly(problem &q, const equations<double> &e)
{
    q.coefficients = e.factor.solve(e.weighted.transpose() * q.root_weight.cwiseProduct(q.off_mm));
}

bool fit_directly(problem &q)
{
    static equations<double> e;
    assemble(q, e);
    if (!factorise(e)) {
        return false;
    }
    solve_directly(q, e);
    q.residual_mm = q.off_mm - q.basis * q.coefficients;
    if (move(q)) {
        solve_directly(q, e);
    }
    return true;
}

/* Peer B: what is left is worked out in double, solved for in float and added, so often before samples are moved and after. */
constexpr int CORRECTIONS = 2;

void correct(problem &q, const equations<float> &e)
{
    for (int i = 0; i < CORRECTIONS; i++) {
        vector right = q.basis.transpose() * q.root_weight.cwiseAbs2().cwiseProduct(q.residual_mm);
        right -= RIDGE * e.normal.diagonal().cast<double>().cwiseProduct(q.coefficients);
        q.coefficients += e.factor.solve(right.cast<float>()).cast<double>();
        q.residual_mm = q.off_mm - q.basis * q.coefficients;
    }
}

bool fit_by_corrections(problem &q)
{
    static equations<float> e;
    assemble(q, e);
    if (!factorise(e)) {
        return false;
    }
    q.coefficients.setZero();
    q.residual_mm = q.off_mm;
    correct(q, e);
    if (move(q)) {
        correct(q, e);
    }
    return true;
}

} // namespace

double peer_node_position(int node)
{
    return (node - (PEER_NODES - 1) / 2) * 10.0 / 11.0;
}

/* Centres stand on nodes, as far apart as there are steps for each, as many on both sides of the middle. */
double peer_centre_position(int centre)
{
    const int steps = CENTRES_STEPS / PEER_CENTRES;
    return peer_node_position((PEER_NODES - 1) / 2 + steps * centre -
                              steps * (PEER_CENTRES - 1) / 2);
}

void peer_begin(peer &p, peer_kind kind, const peer_rig &rig)
{
    p.kind = kind;
    p.rig = rig;
    p.points.resize(PEER_SLOTS);
    p.has_head = false;
    Eigen::ArrayXd x(PEER_NODES * PEER_NODES), y(PEER_NODES * PEER_NODES);
    for (int i = 0; i < PEER_NODES * PEER_NODES; i++) {
        x[i] = peer_node_position(i % PEER_NODES);
        y[i] = peer_node_position(i / PEER_NODES);
    }
    fill_basis(x, y, p.node_basis);
}

void peer_fit_surface(peer &p)
{
    static problem q;
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
    if (!(p.kind == peer_kind::a ? fit_directly(q) : fit_by_corrections(q))) {
        return;
    }
    Eigen::Map<Eigen::VectorXd>(p.surface_mm.data(), PEER_NODES * PEER_NODES).noalias() =
        p.node_basis * q.coefficients;
    p.surface_mm =
        (p.surface_mm.array() + mean_mm).max(std::max(p.nearest_sample_mm - OVERSHOOT_MM, 1.0));
    p.nearest_node_mm = p.surface_mm.minCoeff();
    p.has_surface = true;
}
