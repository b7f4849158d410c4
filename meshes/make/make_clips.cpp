// SPDX-License-Identifier: MIT
// Makes meshes/clips/: the demo motions that come with the library.
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "demo_motions.h"
#include "generator/motion_metrics.h"
#include "geometry/body_model.h"
#include "geometry/clip.h"

namespace {

void Write(const holdfast::DemoMotion& demo, const holdfast::BodyMeasures& body,
           const std::filesystem::path& path) {
  using namespace holdfast;
  WriteClip(demo.clip, path);
  const auto frames = JointTrajectory(demo.clip, body.rest_joints);
  const MotionMetrics m = MeasureMotion(frames, demo.clip.frame_rate);
  std::printf(
      "%s: %d frames, wrist off by %.2f mm and %.1f degrees at most (%d and %d frames), speed %.2f "
      "m/s, jerk %.0f m/s^3 at most, feet slide %.4f mm\n",
      path.c_str(), demo.clip.NumFrames(), 1e3 * demo.report.max_wrist_error_m,
      demo.report.max_hand_error_rad * 180.0 / M_PI, demo.report.frames_out_of_reach,
      demo.report.frames_beyond_wrist, m.joint_speed_m_s.max, m.joint_jerk_m_s3.max,
      m.foot_slide_max_mm_per_frame);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::fprintf(stderr,
                 "usage: make_clips FOLDER    writes demo_drink.npz and demo_inspect.npz\n");
    return argc == 2 && std::string(argv[1]) == "--help" ? 0 : 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    std::filesystem::create_directories(folder);
    const holdfast::BodyMeasures body =
        holdfast::MeasureBody(*holdfast::BodyModel::Default(), Eigen::VectorXd());
    Write(holdfast::DrinkMotion(body), body, folder / "demo_drink.npz");
    Write(holdfast::InspectMotion(body), body, folder / "demo_inspect.npz");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "make_clips: %s\n", e.what());
    return 1;
  }
  return 0;
}
