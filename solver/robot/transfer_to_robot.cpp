// SPDX-License-Identifier: MIT
#include "solver/robot/transfer_to_robot.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/robot/contact_file.h"
#include "solver/robot/finger_choice.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_solver.h"
#include "solver/robot/robot_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

using Clock = std::chrono::steady_clock;

// Standard deviations of the terms.
constexpr double kDistance_m = 0.02;                      // E_d
constexpr double kContact_m = 0.001, kContact_rad = 0.1;  // contact position and normal
constexpr double kFree_m = 0.002, kFreeReach_m = 0.005;   // pads without a contact
constexpr double kPenetration_m = 1e-4;                   // both directions
constexpr double kSelf_m = 3e-4;                          // self-collision of links
constexpr double kChange_rad = 0.15;                      // of joints, between frames
constexpr double kChange_m = 0.01;  // of the wrist in the object's frame, between frames
constexpr double kMargin_m = 3e-4;  // kept between surfaces

constexpr double kObjectCell_m = 0.0015;
constexpr int kMaxObjectSamples = 1500;
constexpr int kObjectVertices = 128, kSkinPoints = 160;  // of E_d
constexpr int kIterations = 15;                          // per frame
constexpr double kNear_m = 0.02;                         // range of skin with full weight in E_d
constexpr double kFarWeight = 0.02;                      // of other skin
constexpr double kDeepest_m = 8e-4;  // deeper penetration is re-solved with a stronger penalty
constexpr int kHarder = 3;           // attempts, each ten times stronger

double Milliseconds(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// Farthest-point sampling of the skin, preferring pads.
std::vector<SkinPair> Spread(const std::vector<SkinPair>& pairs, const Eigen::Matrix3Xd& rest,
                             int most) {
  std::vector<double> away(pairs.size(), 1.0);
  std::vector<SkinPair> chosen;
  while (static_cast<int>(chosen.size()) < std::min<int>(most, static_cast<int>(pairs.size()))) {
    std::size_t farthest = 0;
    double largest = -1.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double value = away[i] * (pairs[i].pad ? 2.0 : 1.0);
      if (value > largest) {
        largest = value;
        farthest = i;
      }
    }
    chosen.push_back(pairs[farthest]);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      away[i] =
          std::min(away[i], (rest.col(pairs[i].vertex) - rest.col(pairs[farthest].vertex)).norm());
    }
  }
  return chosen;
}

// Solver of a whole clip.
class ClipTransfer {
 public:
  ClipTransfer(const RobotTransferSetup& setup, bool on_path, const std::vector<SkinPair>& points)
      : setup_(setup),
        on_path_(on_path),
        solver_(setup.robot),
        points_(points),
        penetration_(*setup.solids, *setup.object_grid, setup.object_samples, kMargin_m,
                     kPenetration_m),
        limits_(1e-3),
        self_(*setup.solids, kSelf_m),
        posed_(setup.robot),
        sigma_q_(Eigen::VectorXd::Constant(setup.robot.NumDofs(), kChange_rad)) {
    for (const RobotLink& link : setup.robot.links) {
      if (link.dof >= 0 && link.kind == RobotJointKind::kSliding) sigma_q_(link.dof) = kChange_m;
    }
  }

  // Solves from `pose` without a previous frame. Returns the cost.
  double StartPose(int t, double penetration_sigma, RobotPose& pose, int* iterations) {
    return Solve(t, pose, nullptr, penetration_sigma, 40, iterations);
  }

  // Solves from the solution `found` of the adjacent frame `from`: fixed to the object while it is
  // held, otherwise moving with the human wrist.
  RobotPose NextPose(int t, int from, const RobotPose& found, int* iterations) {
    RobotPose before = found;
    const HumanFrame &frame = setup_.demonstration.frames[t],
                     &there = setup_.demonstration.frames[from];
    if (!frame.holds) {
      const Eigen::Isometry3d moved =
          frame.object_from_wrist * there.object_from_wrist.inverse() * found.ObjectFromRoot();
      before.R = moved.linear();
      before.T = moved.translation();
    }
    RobotPose pose = before;
    double sigma = kPenetration_m;
    Solve(t, pose, &before, sigma, kIterations, iterations);
    for (int k = 0; k < kHarder && Deepest(pose) > kDeepest_m; ++k) {
      sigma *= 0.1;
      Solve(t, pose, &before, sigma, kIterations, iterations);
    }
    return pose;
  }

 private:
  double Solve(int t, RobotPose& pose, const RobotPose* before, double penetration_sigma,
               int max_iterations, int* iterations) {
    const HumanFrame& frame = setup_.demonstration.frames[t];
    const auto n = static_cast<Eigen::Index>(points_.size());
    Eigen::Matrix3Xd human(3, n);
    Eigen::VectorXd weights(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const int v = points_[i].vertex;
      human.col(i) = frame.vertices.col(v);
      const double near = std::max(frame.distance(v), 0.0) / kNear_m;
      weights(i) = (kFarWeight + std::exp(-near * near)) * 16.0 / static_cast<double>(n);
    }
    const RobotDistanceTerm distances(points_, human, setup_.object_vertices, weights, kDistance_m);
    const RobotContactTerm contacts(setup_.pads, frame.contacts, kContact_m, kContact_rad);
    penetration_.SetSigma(penetration_sigma);
    const RobotPostureTerm posture(setup_.robot.Straight(),
                                   Eigen::VectorXd::Constant(setup_.robot.NumDofs(), 3.0));
    const RobotPlaceTerm place(frame.object_from_wrist * setup_.wrist_from_root,
                               setup_.anatomy.knuckles, on_path_ ? 5.0 * kDegree : 40.0 * kDegree,
                               on_path_ ? 0.01 : 0.08);
    const RobotTouchTerm touch(setup_.pads, *setup_.object_grid, FreePads(frame), kFree_m,
                               kFreeReach_m);
    std::vector<const RobotTerm*> terms{&distances, &contacts, &penetration_, &limits_,
                                        &self_,     &posture,  &place};
    if (frame.holds) terms.push_back(&touch);
    std::optional<RobotPostureTerm> change;
    std::optional<RobotPlaceTerm> movement;
    if (before != nullptr) {
      change.emplace(before->q, sigma_q_);
      movement.emplace(before->ObjectFromRoot(), setup_.anatomy.knuckles, kChange_rad, kChange_m);
      terms.push_back(&*change);
      terms.push_back(&*movement);
    }
    // Starts are compared by their costs; frames start from their neighbors' solutions.
    ceres::Solver::Options options =
        DenseOptions(max_iterations, 1e-4, before != nullptr ? 1e-4 : 1e-5);
    // If nearest pad points switch, a first step is often too long: reuse the last trust region.
    if (before != nullptr) options.initial_trust_region_radius = radius_;
    const ceres::Solver::Summary summary = solver_.Solve(terms, options, pose);
    *iterations += StepsOf(summary);
    if (!summary.iterations.empty()) {
      radius_ = std::clamp(10.0 * summary.iterations.back().trust_region_radius, 1e-2, 1e4);
    }
    // RobotBlock::Solve has clamped the joints: the cost is that of the clamped pose.
    posed_.Set(pose);
    double cost = 0.0;
    for (const RobotTerm* term : terms) cost += term->Add(posed_, nullptr);
    return cost;
  }

  // Parts of the human hand without a contact in this frame, of those that the robot has.
  std::vector<int> FreePads(const HumanFrame& frame) const {
    std::vector<int> parts;
    for (int part = 0; part < kNumHandParts; ++part) {
      const auto is_part = [&](const PartContact& contact) { return contact.part == part; };
      if (!setup_.pads.Empty(part) && std::ranges::none_of(frame.contacts, is_part)) {
        parts.push_back(part);
      }
    }
    return parts;
  }

  double Deepest(const RobotPose& pose) {
    posed_.Set(pose);
    return penetration_.Deepest(posed_);
  }

  const RobotTransferSetup& setup_;
  bool on_path_;
  RobotBlock solver_;
  const std::vector<SkinPair>& points_;
  RobotPenetrationTerm penetration_;
  RobotLimitTerm limits_;
  RobotSelfTerm self_;
  PosedRobot posed_;
  Eigen::VectorXd sigma_q_;
  double radius_ = 1e4;  // of the last solve, slightly enlarged
};

// Solves a frame from all starts and returns the selected pose.
RobotPose FirstPose(const RobotTransferSetup& setup, const RobotTransferOptions& options,
                    const std::vector<SkinPair>& points, int t, int* iterations) {
  constexpr double kLoosely_m = 3e-3;
  std::vector<RobotPose> poses =
      RobotStarts(setup.demonstration.frames[t], setup.wrist_from_root, setup.anatomy);
  for (RobotPose& pose : ContactStarts(setup, setup.demonstration.frames[t])) {
    poses.push_back(std::move(pose));
  }
  std::vector<double> costs(poses.size());
  std::vector<int> tried(poses.size());
  const auto solve = [&](double sigma) {
    ParallelFor(static_cast<int>(poses.size()), options.threads, [&](int k) {
      costs[k] =
          ClipTransfer(setup, options.on_path, points).StartPose(t, sigma, poses[k], &tried[k]);
    });
  };
  // Loose penalty first: contacts pull while the hand leaves the object. Then the worst third is
  // dropped: keeping fewer gave a worse result on one of four hands.
  solve(kLoosely_m);
  std::vector<std::size_t> best(poses.size());
  std::iota(best.begin(), best.end(), std::size_t{0});
  std::ranges::stable_sort(best, {}, [&](std::size_t k) { return costs[k]; });
  best.resize(2 * poses.size() / 3);
  std::ranges::sort(best);
  for (std::size_t k = 0; k < best.size(); ++k) poses[k] = poses[best[k]];
  poses.resize(best.size());
  costs.resize(best.size());
  solve(kPenetration_m);
  *iterations += std::accumulate(tried.begin(), tried.end(), 0);
  return poses[ChooseStart(setup, poses, costs)];
}

}  // namespace

OptionTable OptionsOf(RobotTransferOptions& options) {
  using OptionalSide = std::optional<Side>;
  OptionTable table;
  table.Group("Target robot hand");
  table.Choice("hand", options.side,
               {{"auto", OptionalSide()}, {"right", Side::kRight}, {"left", Side::kLeft}},
               "Hand to transfer; auto: the one that holds the object longer");
  table.Flag("robot_on_path", options.on_path,
             "Keep the robot's wrist within about 1 cm of the human's");
  return table;
}

RobotTransferSetup PrepareRobotTransfer(const ClipScene& scene, RobotHand robot,
                                        const RobotTransferOptions& options) {
  if (!scene.clip.object) {
    throw Error(scene.source, "has no object trajectory", "Make one with 'holdfast fit'");
  }
  if (!scene.object) {
    throw Error(scene.source, "its object's mesh is missing: " + scene.object_missing,
                "Say where it is with --object");
  }
  RobotTransferSetup setup;
  setup.robot = std::move(robot);
  setup.object = *scene.object;
  setup.object_distance = std::make_unique<SignedDistance>(setup.object);
  const Side side = options.side.value_or(HoldingSide(scene, *setup.object_distance));
  RequireHands(*scene.body, HoldingBit(side));
  setup.anatomy = options.correspondence.empty() ? FindAnatomy(setup.robot, side)
                                                 : AnatomyOf(setup.robot, options.correspondence,
                                                             options.correspondence_source, side);
  if (setup.anatomy.side != side) {
    throw Error(setup.robot.source,
                fmt::format("is a {} hand, but in {} the {} hand holds the object",
                            SideName(setup.anatomy.side), scene.source, SideName(side)),
                "Give the robot's hand of that side, or transfer the other hand (--hand)");
  }
  setup.human = std::make_shared<const HandModel>(scene.body, scene.betas, side);
  setup.axes = std::make_unique<HandAxes>(*setup.human);
  setup.landmarks = std::make_unique<HandLandmarks>(*setup.human, *setup.axes);
  setup.demonstration =
      ReadDemonstration(scene, *setup.human, *setup.landmarks, *setup.axes, *setup.object_distance);
  if (!options.contacts.empty()) {
    ReadContacts(options.contacts, *setup.object_distance, setup.demonstration);
  }
  // The grasp decides which human fingers are kept, unless a correspondence is given.
  const int fingers = static_cast<int>(setup.anatomy.fingers.size());
  if (options.correspondence.empty() && fingers < kNumFingers) {
    const HumanFrame& fullest =
        setup.demonstration.frames[static_cast<std::size_t>(AnchorFrame(setup.demonstration))];
    const std::vector<int> chosen = ChooseFingers(fullest, setup.object, fingers);
    for (std::size_t k = 0; k < chosen.size(); ++k) setup.anatomy.fingers[k].human = chosen[k];
  }
  setup.pairs = PairSkins(*setup.human, *setup.landmarks, *setup.axes, setup.robot, setup.anatomy);
  setup.solids = std::make_unique<RobotSolids>(setup.robot, setup.anatomy, options.threads);
  setup.pads = RobotPads(setup.pairs, *setup.solids, setup.anatomy.gripper);
  setup.object_grid = std::make_unique<DistanceGrid>(
      *setup.object_distance,
      DistanceGridOptions{.cell_m = kObjectCell_m, .threads = options.threads});
  setup.object_samples = InBlocks(ContactSamples(setup.object, 0.004, kMaxObjectSamples));
  setup.object_vertices = ContactSamples(setup.object, 0.012, kObjectVertices);
  setup.wrist_from_root = WristFromRoot(*setup.axes, setup.anatomy);
  // Contacts without a corresponding pad cannot be preserved.
  for (HumanFrame& frame : setup.demonstration.frames) {
    setup.contacts_left_out +=
        static_cast<int>(std::erase_if(frame.contacts, [&](const PartContact& contact) {
          return setup.pads.Empty(contact.part);
        }));
  }
  return setup;
}

RobotTransfer TransferToRobot(const RobotTransferSetup& setup, const RobotTransferOptions& options,
                              const StagedProgress& progress) {
  const int frames = static_cast<int>(setup.demonstration.frames.size());
  RobotTransfer out;
  out.poses.resize(static_cast<std::size_t>(frames));
  const std::vector<SkinPair> points =
      Spread(setup.pairs, setup.human->Surface().RestVertices(), kSkinPoints);
  const int anchor = AnchorFrame(setup.demonstration);
  const Clock::time_point begin = Clock::now();
  out.poses[anchor] = FirstPose(setup, options, points, anchor, &out.iterations);
  out.start_ms = Milliseconds(begin);
  const Clock::time_point follow = Clock::now();
  ClipTransfer transfer(setup, options.on_path, points);
  int done = 0;
  const auto report = [&] { out.stopped = progress && !progress("transfer", ++done, frames); };
  // Each frame starts from the last solved frame, whose grasp may be the same.
  const auto follow_to = [&](int end, int step) {
    int from = anchor;
    for (int t = anchor + step; t != end && !out.stopped; t += step) {
      if (SameGrasp(setup.demonstration.frames[t], setup.demonstration.frames[from])) {
        out.poses[t] = out.poses[from];
      } else {
        out.poses[t] = transfer.NextPose(t, from, out.poses[from], &out.iterations);
        from = t;
      }
      report();
    }
  };
  out.poses[anchor] = transfer.NextPose(anchor, anchor, out.poses[anchor], &out.iterations);
  report();
  follow_to(frames, 1);
  follow_to(-1, -1);
  out.solve_ms = Milliseconds(follow);
  return out;
}

}  // namespace holdfast
