// SPDX-License-Identifier: MIT
#include "solver/trial/trial_film.h"

#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "geometry/parallel.h"
#include "geometry/render/contact_sheet.h"
#include "geometry/render/rasterizer.h"
#include "geometry/render/video.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kTurnFrames = 12;
constexpr double kFilmRate = 30.0;

// One image: a moment of a run, and the wrist's orientation in the world.
struct FilmFrame {
  const TrialCourse* course;
  std::size_t moment;
  Eigen::Quaterniond world_from_wrist;
  std::string text;
};

std::vector<FilmFrame> FramesOfTrial(const HoldTrial& hold,
                                     const Eigen::Matrix3d& wrist_from_object,
                                     const Eigen::Quaterniond& start) {
  std::vector<FilmFrame> frames;
  for (std::size_t k = 0; k < hold.settling.hand_from_object.size(); ++k) {
    frames.push_back({&hold.settling, k, start, "SQUEEZE"});
  }
  Eigen::Quaterniond now = start;
  for (int direction = 0; direction < kTrialDirections; ++direction) {
    const TrialCourse& course = hold.directions[static_cast<std::size_t>(direction)];
    const Eigen::Vector3d down = now * (wrist_from_object * TrialDirection(direction));
    const Eigen::Quaterniond next = RotationBetween(down, -Eigen::Vector3d::UnitZ()) * now;
    const std::string name = fmt::format("GRAVITY {}", TrialDirectionName(direction));
    for (int k = 0; k < kTurnFrames; ++k) {
      const double s = 0.5 - 0.5 * std::cos(std::numbers::pi * (k + 0.5) / kTurnFrames);
      frames.push_back({&course, 0, now.slerp(s, next), name});
    }
    now = next;
    for (std::size_t k = 0; k < course.hand_from_object.size(); ++k) {
      frames.push_back({&course, k, now, name});
    }
    frames.back().text +=
        fmt::format(": SLIP {:.1f} MM {:.1f} DEG", course.slip_mm, course.slip_deg);
  }
  return frames;
}

}  // namespace

void WriteTrialFilm(const std::filesystem::path& path, const ClipScene& scene,
                    const ClipTrial& trial, int threads) {
  const HandModel hand(scene.body, scene.betas, trial.side);
  const JointPose& pose = scene.clip.pose[static_cast<std::size_t>(trial.begin)];
  const Eigen::Vector3d trans = scene.clip.trans.col(trial.begin);
  HandState first(hand);
  first.SetBody(pose, trans);
  const Eigen::Isometry3d wrist_from_object =
      first.WorldFromWrist().inverse() * scene.clip.object->Pose(trial.begin);
  const std::vector<FilmFrame> frames = FramesOfTrial(trial.hold, wrist_from_object.linear(),
                                                      Eigen::Quaterniond(first.WristRotation()));
  // Keep the center of the object fixed.
  const Eigen::Vector3d middle =
      wrist_from_object * (0.5 * (scene.object->vertices.rowwise().minCoeff() +
                                  scene.object->vertices.rowwise().maxCoeff()));
  const double radius = 0.09 + 0.5 * Extent(*scene.object).norm();
  const Camera camera = CloseUpCamera(Eigen::Vector3d::Zero(), radius, 0.5, 0.15);
  RenderOptions picture;
  picture.width = 480;
  picture.height = 480;
  picture.ground = false;
  const auto draw = [&](const FilmFrame& frame) {
    HandState state(hand);
    state.SetBody(pose, trans);
    state.Evaluate(frame.course->fingers[frame.moment], false);
    const Eigen::Isometry3d view =
        Eigen::Isometry3d(frame.world_from_wrist) * Eigen::Translation3d(-middle);
    const TriangleMesh skin{view * state.WorldFromWrist().inverse() * state.Vertices(),
                            hand.Surface().Faces()};
    const TriangleMesh object{
        view * frame.course->hand_from_object[frame.moment] * scene.object->vertices,
        scene.object->faces};
    const std::array items = {RenderItem{&skin, {0.80, 0.62, 0.52}},
                              RenderItem{&object, {0.30, 0.45, 0.66}}};
    Image image = Render(items, camera, picture);
    DrawLabel(image, 12, 12, frame.text, 2);
    return image;
  };
  WriteVideo(path, static_cast<int>(frames.size()), {kFilmRate, 2 * threads},
             [&](std::span<const int> which) {
               std::vector<Image> images(which.size());
               ParallelFor(static_cast<int>(which.size()), threads, [&](int k) {
                 images[static_cast<std::size_t>(k)] =
                     draw(frames[static_cast<std::size_t>(which[static_cast<std::size_t>(k)])]);
               });
               return images;
             });
}

}  // namespace holdfast
