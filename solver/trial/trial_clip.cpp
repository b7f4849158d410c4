// SPDX-License-Identifier: MIT
#include "solver/trial/trial_clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "geometry/parallel.h"
#include "geometry/render/image.h"
#include "geometry/render/rasterizer.h"
#include "geometry/render/video.h"
#include "geometry/rotation.h"
#include "geometry/score/hand_object_score.h"

namespace holdfast {
namespace {

// Begin and end of the longest run of frames with exactly these bits.
std::pair<int, int> LongestRun(const std::vector<std::uint8_t>& holding, std::uint8_t bits) {
  std::pair<int, int> best{0, 0};
  const int count = static_cast<int>(holding.size());
  for (int begin = 0, end = 0; begin < count; begin = end + 1) {
    for (end = begin; end < count && holding[static_cast<std::size_t>(end)] == bits;) ++end;
    if (end - begin > best.second - best.first) best = {begin, end};
  }
  return best;
}

// Selects hand and frames to try; begin equals end if there are none.
ClipTrial ChooseHold(const ClipScene& scene, const SignedDistance& distance) {
  const Clip& clip = scene.clip;
  ClipTrial trial;
  if (!clip.holding_hand.empty()) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const auto run =
          LongestRun(clip.holding_hand, side == Side::kRight ? kHoldsRight : kHoldsLeft);
      if (!scene.body->HasHand(side) || run.second - run.first <= trial.end - trial.begin) continue;
      trial.side = side;
      std::tie(trial.begin, trial.end) = run;
    }
    return trial;
  }
  trial.end = clip.NumFrames();
  if (const std::optional<Side> lone = scene.body->LoneHand()) {
    trial.side = *lone;
  } else {
    const auto away = [&](Side side) {
      return MeanDistance(clip, HandModel(scene.body, scene.betas, side), distance,
                          clip.NumFrames());
    };
    trial.side = away(Side::kLeft) < away(Side::kRight) ? Side::kLeft : Side::kRight;
  }
  return trial;
}

// Whether `side` holds, per frame.
std::vector<bool> HoldsOf(const ClipScene& scene, Side side, const ClipTrial& nearer) {
  const std::vector<std::uint8_t> flags = HoldFlags(scene.clip.holding_hand, side);
  if (!flags.empty()) return {flags.begin(), flags.end()};
  return std::vector<bool>(static_cast<std::size_t>(scene.clip.NumFrames()), side == nearer.side);
}

// Joint torques for these presses, about the axes of the springs.
std::array<Eigen::Vector3d, kJointsPerHand> SqueezeOf(const std::vector<MjcfLink>& links,
                                                      const std::vector<GripContact>& contacts) {
  std::vector<Eigen::Isometry3d> hand_from_link;
  for (const MjcfLink& link : links) {
    const Eigen::Isometry3d own = RigidTransform(link.rest.toRotationMatrix(), link.joint);
    hand_from_link.push_back(link.parent < 0 ? own : hand_from_link[link.parent] * own);
  }
  std::array<Eigen::Vector3d, kJointsPerHand> squeeze;
  squeeze.fill(Eigen::Vector3d::Zero());
  for (const GripContact& contact : contacts) {
    for (int k = contact.link; links[k].parent >= 0; k = links[k].parent) {
      const Eigen::Vector3d torque =
          (contact.point - hand_from_link[k].translation()).cross(contact.press);
      squeeze[k - 1] += (hand_from_link[k].linear() * links[k].axes).transpose() * torque;
    }
  }
  return squeeze;
}

// The hand of one side; nothing if it never touches the object while holding.
std::optional<MjcfHand> SimulatedHand(const ClipScene& scene, Side side,
                                      const std::vector<bool>& holds, const TrialSolid& solid,
                                      const SignedDistance& distance,
                                      const TrialProtocol& protocol) {
  const HandModel model(scene.body, scene.betas, side);
  HandState state(model);
  MjcfHand hand;
  hand.side = side;
  hand.damping_Nms = protocol.scene.joint_damping_Nms;
  hand.inertia_kg_m2 = protocol.scene.joint_inertia_kg_m2;
  std::array<Eigen::Vector3d, kJointsPerHand> none;
  none.fill(Eigen::Vector3d::Zero());
  hand.squeeze_Nm.assign(holds.size(), none);
  bool pressing = false;  // since this hold's first touch
  for (std::size_t t = 0; t < holds.size(); ++t) {
    pressing = pressing && holds[t];
    if (pressing) hand.squeeze_Nm[t] = hand.squeeze_Nm[t - 1];
    if (!holds[t] || pressing) continue;
    state.SetBody(scene.clip.pose[t], scene.clip.trans.col(static_cast<Eigen::Index>(t)));
    state.Evaluate(FingersOf(scene.clip.pose[t], side), false);
    const std::vector<GripContact> contacts = PressesOfHand(
        state, scene.clip.object->Pose(static_cast<int>(t)), solid, distance, protocol);
    if (contacts.empty()) continue;
    const std::vector<MjcfLink> links = LinksOfHand(state, protocol.fingers);
    if (hand.links.empty()) hand.links = links;
    hand.squeeze_Nm[t] = SqueezeOf(links, contacts);
    pressing = true;
  }
  if (hand.links.empty()) return std::nullopt;
  return hand;
}

nlohmann::json CourseJson(const TrialCourse& course) {
  return {{"holds", course.holds},
          {"touches_at_end", course.touches},
          {"stable", course.stable},
          {"slip_mm", course.slip_mm},
          {"slip_deg", course.slip_deg},
          {"most_slip_mm", course.most_slip_mm},
          {"most_slip_deg", course.most_slip_deg}};
}

}  // namespace

std::optional<ClipTrial> TryClip(const ClipScene& scene, const TrialProtocol& protocol) {
  RequirePhysics();
  if (!scene.clip.object || !scene.object) return std::nullopt;
  const SignedDistance distance(*scene.object);
  ClipTrial trial = ChooseHold(scene, distance);
  if (trial.begin == trial.end) return std::nullopt;
  const HandModel hand(scene.body, scene.betas, trial.side);
  HandState state(hand);
  HandMotion motion;
  motion.frame_rate = scene.clip.frame_rate;
  for (int t = trial.end; t-- > trial.begin;) {  // ends at the first frame, which is tried
    state.SetBody(scene.clip.pose[t], scene.clip.trans.col(t));
    motion.world_from_wrist.push_back(state.WorldFromWrist());
    motion.fingers.push_back(FingersOf(scene.clip.pose[t], trial.side));
  }
  std::ranges::reverse(motion.world_from_wrist);
  std::ranges::reverse(motion.fingers);
  state.Evaluate(motion.fingers.front(), false);
  const TrialSolid solid = MakeTrialSolid(*scene.object, distance, protocol);
  trial.pieces = static_cast<int>(solid.pieces.size());
  trial.excess_mm = solid.excess_mm;
  trial.hold = TryHold(state, scene.clip.object->Pose(trial.begin), solid, distance, protocol,
                       trial.end - trial.begin > 1 ? &motion : nullptr);
  return trial;
}

std::optional<MjcfPhysics> PhysicsOfClip(const ClipScene& scene,
                                         std::optional<double> density_kg_m3,
                                         TrialProtocol protocol) {
  if (!scene.clip.object || !scene.object) return std::nullopt;
  if (density_kg_m3) {
    protocol.density_kg_m3 = *density_kg_m3;
    protocol.least_mass_kg = 0.0;
    protocol.most_mass_kg = std::numeric_limits<double>::infinity();
  }
  const SignedDistance distance(*scene.object);
  const TrialSolid solid = MakeTrialSolid(*scene.object, distance, protocol);
  MjcfPhysics physics;
  physics.object_pieces = solid.pieces;
  physics.mass_kg = solid.mass.mass_kg;
  physics.center = solid.mass.center;
  physics.inertia = solid.mass.inertia;
  physics.mass_of_pieces = solid.mass_of_pieces;
  physics.step_s = protocol.scene.step_s;
  physics.friction = protocol.scene.friction;
  physics.torsion_m = protocol.scene.torsion_m;
  const ClipTrial nearer =
      scene.clip.holding_hand.empty() ? ChooseHold(scene, distance) : ClipTrial();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (!scene.body->HasHand(side)) continue;
    std::optional<MjcfHand> hand =
        SimulatedHand(scene, side, HoldsOf(scene, side, nearer), solid, distance, protocol);
    if (hand) physics.hands.push_back(std::move(*hand));
  }
  return physics;
}

nlohmann::json TrialJson(const ClipTrial& trial) {
  const HoldTrial& hold = trial.hold;
  nlohmann::json json = {{"hand", SideName(trial.side)},
                         {"first_frame", trial.begin},
                         {"frames", trial.end - trial.begin},
                         {"held_directions", hold.Held()},
                         {"worst_slip_mm", hold.WorstSlip_mm()},
                         {"worst_slip_deg", hold.WorstSlip_deg()},
                         {"mass_kg", hold.mass_kg},
                         {"grip_N", hold.grip_N},
                         {"pressing_contacts", hold.pressing},
                         {"object_pieces", trial.pieces},
                         {"object_pieces_reach_out_mm", trial.excess_mm},
                         {"settling", CourseJson(hold.settling)},
                         {"clip", hold.clip ? CourseJson(*hold.clip) : nlohmann::json(nullptr)}};
  for (int k = 0; k < kTrialDirections; ++k) {
    nlohmann::json course = CourseJson(hold.directions[static_cast<std::size_t>(k)]);
    course["gravity"] = TrialDirectionName(k);
    json["directions"].push_back(std::move(course));
  }
  return json;
}

nlohmann::json TrialProtocolJson(const TrialProtocol& protocol) {
  const auto numbers = [](const Eigen::Vector3d& v) {
    return std::vector<double>(v.begin(), v.end());
  };
  return {{"engine", "MuJoCo"},
          {"density_kg_m3", protocol.density_kg_m3},
          {"mass_kg", {protocol.least_mass_kg, protocol.most_mass_kg}},
          {"gravity_m_s2", protocol.gravity_m_s2},
          {"friction", protocol.scene.friction},
          {"torsional_friction_m", protocol.scene.torsion_m},
          {"touch_mm", 1e3 * protocol.touch_m},
          {"grip_weights", protocol.grip_weights},
          {"least_grip_N", protocol.least_grip_N},
          {"settle_s", protocol.settle_s},
          {"settle_drag_per_s", protocol.settle_drag_per_s},
          {"hold_s", protocol.hold_s},
          {"limit_mm", protocol.most_mm},
          {"limit_deg", protocol.most_deg},
          {"time_step_s", protocol.scene.step_s},
          {"joint_stiffness_Nm_rad", numbers(protocol.fingers.stiffness_Nm)},
          {"joint_torque_limit_Nm", numbers(protocol.fingers.torque_limit_Nm)},
          {"joint_side_stiffness_Nm_rad", protocol.fingers.side_stiffness_Nm}};
}

std::string TrialText(const ClipTrial& trial) {
  const HoldTrial& hold = trial.hold;
  std::string text = fmt::format(
      "{} hand, {:.0f} g, grip {:.0f} N: holds in {} of 6 directions of gravity (slip at most "
      "{:.1f} mm, {:.1f} deg",
      SideName(trial.side), 1e3 * hold.mass_kg, hold.grip_N, hold.Held(), hold.WorstSlip_mm(),
      hold.WorstSlip_deg());
  text += fmt::format("; settled by {:.1f} mm, {:.1f} deg)", hold.settling.slip_mm,
                      hold.settling.slip_deg);
  if (hold.clip) {
    text += fmt::format(", {} along the clip (slip {:.1f} mm at the end, {:.1f} mm at most)",
                        hold.clip->holds ? "holds" : "is lost", hold.clip->slip_mm,
                        hold.clip->most_slip_mm);
  }
  return text;
}

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
  WriteVideo(path, static_cast<int>(frames.size()), kFilmRate, 2 * threads,
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
