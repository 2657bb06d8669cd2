/* bench_peer a|b --turns|--once|--results RIG.json FRAME.pgm... [RIG.json FRAME.pgm...]
 *
 * Peer A or B over frames that are in memory; modes and output as those of bench_isohead. One thread;
 * freed memory stays with the process: otherwise page faults cost them up to a millisecond a frame. */
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>

#include <malloc.h>

#include <opencv2/core/utility.hpp>

#include "bench_input.h"
#include "peer.hpp"

namespace
{

struct stage {
    const char *name;
    void (*run)(peer &p);
    int64_t time_ns;
};

stage stages[] = {{"dots", peer_find_dots, 0},      {"labels", peer_find_labels, 0},
                  {"points", peer_find_samples, 0}, {"surface", peer_fit_surface, 0},
                  {"nests", peer_find_nests, 0},    {"findings", peer_find_hypotheses, 0}};

void print_result(const peer &p)
{
    std::printf("{\"dots\":[");
    for (size_t i = 0; i < p.dots.size(); i++) {
        std::printf("%s[%.4f,%.4f]", i > 0 ? "," : "", p.dots[i].x, p.dots[i].y);
    }
    std::printf("],\"labels\":[");
    const char *comma = "";
    for (int slot = 0; slot < PEER_SLOTS; slot++) {
        const peer_point &point = p.points[static_cast<size_t>(slot)];
        if (point.seen) {
            std::printf("%s[%d,%d,%.3f]", comma, slot, point.dot, point.depth_mm);
            comma = ",";
        }
    }
    std::printf("],\"surface\":[");
    for (Eigen::Index i = 0; p.has_surface && i < p.surface_mm.size(); i++) {
        std::printf("%s%.2f", i > 0 ? "," : "", p.surface_mm.data()[i]);
    }
    std::printf("],\"centres\":%d,\"points\":%d,\"head\":", PEER_CENTRES, PEER_POINTS);
    if (p.has_head) {
        const double *c = p.head.centre_mm;
        std::printf("[%.2f,%.2f,%.2f]}\n", c[0], c[1], c[2]);
    } else {
        std::puts("null}");
    }
}

cv::Mat view_of(const bench_frame &frame)
{
    return {frame.height, frame.width, frame.bytes_per_sample == 1 ? CV_8U : CV_16U, frame.samples};
}

/* A frame stage by stage; the time of all of it. */
int64_t timed_frame(peer &p, const cv::Mat &image)
{
    int64_t began_ns = bench_now_ns(), last_ns = began_ns;
    p.image = image;
    for (stage &s : stages) {
        s.run(p);
        int64_t now_ns = bench_now_ns();
        s.time_ns += now_ns - last_ns;
        last_ns = now_ns;
    }
    return last_ns - began_ns;
}

/* All frames; their time together. */
int64_t timed_frames(const bench_input &input, std::vector<peer> &peers)
{
    int64_t whole_ns = 0;
    for (stage &s : stages) {
        s.time_ns = 0;
    }
    for (int set = 0; set < input.set_count; set++) {
        peer &p = peers[static_cast<size_t>(set)];
        p.has_head = false;
        for (int i = 0; i < input.sets[set].frame_count; i++) {
            whole_ns += timed_frame(p, view_of(input.sets[set].frame[i]));
        }
    }
    return whole_ns;
}

void take_turn(const bench_input &input, std::vector<peer> &peers)
{
    static_cast<void>(timed_frames(input, peers)); // warm up after the others' turns
    const int64_t whole_ns = timed_frames(input, peers);
    std::printf("{\"whole\":%.0f", static_cast<double>(whole_ns) / input.frame_count);
    for (const stage &s : stages) {
        std::printf(",\"%s\":%.0f", s.name, static_cast<double>(s.time_ns) / input.frame_count);
    }
    std::puts("}");
    std::fflush(stdout);
}

void run_once(const bench_input &input, std::vector<peer> &peers, bool is_results)
{
    for (int set = 0; set < input.set_count; set++) {
        peer &p = peers[static_cast<size_t>(set)];
        for (int i = 0; i < input.sets[set].frame_count; i++) {
            peer_frame(p, view_of(input.sets[set].frame[i]));
            if (is_results) {
                print_result(p);
            }
        }
    }
}

int run(int argument_count, char **arguments)
{
    std::string kind = argument_count > 2 ? arguments[1] : "";
    std::string mode = argument_count > 2 ? arguments[2] : "";
    if ((kind != "a" && kind != "b") ||
        (mode != "--turns" && mode != "--once" && mode != "--results")) {
        std::fputs("usage: bench_peer a|b --turns|--once|--results RIG.json FRAME.pgm...\n",
                   stderr);
        return 2;
    }
    bench_input input;
    if (!bench_input_load(argument_count - 3, arguments + 3, &input)) {
        return 1;
    }
    cv::setNumThreads(1);
    std::vector<peer> peers(static_cast<size_t>(input.set_count));
    for (int set = 0; set < input.set_count; set++) {
        peer_begin(peers[static_cast<size_t>(set)], kind == "a" ? peer_kind::a : peer_kind::b,
                   peer_rig_read(input.sets[set].rig_path));
    }
    if (mode != "--turns") {
        run_once(input, peers, mode == "--results");
        return 0;
    }
    for (std::string line; std::getline(std::cin, line);) {
        take_turn(input, peers);
    }
    return 0;
}

} // namespace

int main(int argument_count, char **arguments)
{
    mallopt(M_TRIM_THRESHOLD, 1000000000);
    mallopt(M_MMAP_THRESHOLD, 1000000000);
    try {
        return run(argument_count, arguments);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bench_peer: %s\n", error.what());
        return 1;
    }
}
