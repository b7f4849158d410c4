// SPDX-License-Identifier: MIT
// Makes meshes/clips/: the demo motions that come with the library.
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "generator/actions/face_marks.h"
#include "generator/scripted/handover_motion.h"
#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/embedded.h"
#include "geometry/io/mesh/mesh_io.h"
#include "meshes/make/clips/demo_motions.h"

namespace {

void Write(holdfast::DemoMotion demo, const holdfast::BodyMeasures& body,
           const std::filesystem::path& path) {
  using namespace holdfast;
  demo.clip.body_model = BodyModel::Default()->Name();
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

// The body's part of a handover: the object comes from `holdfast offhand`. The hands meet as far
// apart as an apple is wide.
void WritePass(const holdfast::BodyMeasures& body, const std::filesystem::path& path) {
  using namespace holdfast;
  const EmbeddedFile file = FindEmbedded("objects/apple.ply");
  const TriangleMesh apple =
      ReadMeshBytes({reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()},
                    file.name)
          .mesh;
  HandoverOptions options;
  options.switches = 1;
  options.first_hand = Side::kRight;
  options.min_dwell_s = options.max_dwell_s = 0.5;
  options.seed = 11;
  HandoverMotion motion =
      MakeHandoverMotion(body, PalmGrasps(body, apple.vertices, options.seed), options);
  motion.clip.body_model = BodyModel::Default()->Name();
  motion.clip.object.reset();
  motion.clip.holding_hand.clear();
  WriteClip(motion.clip, path);
  std::printf("%s: %d frames, hands meet about frame %d\n", path.c_str(), motion.clip.NumFrames(),
              motion.switch_frames.front());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::fprintf(
        stderr,
        "usage: make_clips FOLDER    writes demo_drink.npz, demo_inspect.npz and demo_pass.npz\n");
    return argc == 2 && std::string(argv[1]) == "--help" ? 0 : 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    std::filesystem::create_directories(folder);
    const auto model = holdfast::BodyModel::Default();
    const holdfast::BodyMeasures body = holdfast::MeasureBody(*model, Eigen::VectorXd());
    const holdfast::FaceMarks face =
        holdfast::FindFaceMarks(holdfast::BodySurface(model, Eigen::VectorXd()));
    Write(holdfast::DrinkMotion(body, face.mouth), body, folder / "demo_drink.npz");
    Write(holdfast::InspectMotion(body), body, folder / "demo_inspect.npz");
    WritePass(body, folder / "demo_pass.npz");
  } catch (const std::exception& e) {
    std::fprintf(stderr, "make_clips: %s\n", e.what());
    return 1;
  }
  return 0;
}
