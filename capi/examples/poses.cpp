// A set of keys, a clip by slerp, and one pose a frame, with tumble.hpp.
#include <tumble.hpp>

#include <array>
#include <cstdio>
#include <vector>

int main() {
    const std::vector<double> times = {0.0, 0.5, 1.25};
    const std::vector<float> keys = {0, 0, 0, 1, 0, 0, 0.6f, 0.8f, 0, 0, 0.8f, 0.6f}; // x y z w
    try {
        auto engine = tumble::make(tumble_engine_open, "cpu", nullptr);
        auto set = tumble::make(tumble_set_new);
        tumble::check(tumble_set_push(set.get(), "elbow", times.data(), keys.data(), times.size()));
        TumbleInterpolation how = {};
        how.size = sizeof how;
        how.method = "slerp";
        auto clip = tumble::make(tumble_upload, engine.get(), set.get(), &how);
        auto sampler = tumble::make(tumble_sampler_new, clip.get());
        for (int frame = 0; frame < 3; ++frame) {
            std::array<float, 4> pose;
            tumble::check(tumble_sampler_pose(sampler.get(), frame * 0.25, pose.data(), pose.size()));
            std::printf("%g %.9g %.9g %.9g %.9g\n", frame * 0.25, pose[0], pose[1], pose[2], pose[3]);
        }
    } catch (const tumble::Error &error) {
        std::fprintf(stderr, "tumble: %s\n", error.what());
        return 1;
    }
}
