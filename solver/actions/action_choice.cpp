// SPDX-License-Identifier: MIT
#include "solver/actions/action_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/actions/action_measures.h"
#include "solver/actions/action_studio.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kTouch_m = 0.0008;  // remaining depth accepted after a push
constexpr int kPushes = 6;
constexpr double kFarPush_m = 0.05;
constexpr double kEasyShortfall_m = 0.04;  // compensated by the trunk
constexpr double kWorst = 200.0;           // per key; beyond this all poses count as equally bad

double Square(double x) { return x * x; }

// A candidate pose at a key.
struct Candidate {
  Isometry3d object;  // relative to the anchor
  Isometry3d world;   // of the object, for the nominal body
  double cost = 0.0;
};

class ActionKeySearch {
 public:
  ActionKeySearch(const ActionActor& actor, const BodyPlacement& start, const ActionScript& script,
                  const Eigen::Matrix3Xd& object_points)
      : actor_(actor), script_(script), object_points_(object_points) {
    for (const ScriptKey& key : script.keys) {
      stances_.push_back(StanceAt(start, script, key.arrive_s));
    }
  }

  // Returns the best keys for one grasp; tries every `every`-th pose.
  ActionChoice Choose(const ActionGrasp& grasp, int every) const {
    std::vector<int> chain;
    std::vector<std::vector<Candidate>> tried;
    for (int k = 0; k < static_cast<int>(script_.keys.size()); ++k) {
      if (script_.keys[k].same_as) continue;
      chain.push_back(k);
      tried.push_back(Candidates(grasp, k, every));
    }
    std::vector<std::vector<int>> from(tried.size());
    std::vector<double> total;
    for (std::size_t s = 0; s < tried.size(); ++s) {
      std::vector<double> next;
      from[s].assign(tried[s].size(), 0);
      for (std::size_t c = 0; c < tried[s].size(); ++c) {
        double least = s == 0 ? 0.0 : std::numeric_limits<double>::infinity();
        for (std::size_t p = 0; s > 0 && p < tried[s - 1].size(); ++p) {
          const double way =
              total[p] + WayCost(tried[s - 1][p], tried[s][c], script_.keys[chain[s]].turned_rad);
          if (way < least) {
            least = way;
            from[s][c] = static_cast<int>(p);
          }
        }
        next.push_back(least + tried[s][c].cost);
      }
      total = std::move(next);
    }
    ActionChoice choice;
    choice.keys.resize(script_.keys.size());
    auto at = std::ranges::min_element(total) - total.begin();
    choice.cost = total[at];
    for (std::size_t s = tried.size(); s-- > 0;) {
      const Candidate& chosen = tried[s][at];
      choice.keys[chain[s]] = chosen.object;
      choice.worst_key = std::max(choice.worst_key, chosen.cost);
      at = from[s][at];
    }
    for (std::size_t k = 0; k < script_.keys.size(); ++k) {
      const std::optional<int> same = script_.keys[k].same_as;
      if (same) choice.keys[k] = choice.keys[*same];
    }
    return choice;
  }

 private:
  std::vector<Candidate> Candidates(const ActionGrasp& grasp, int k, int every) const {
    const ScriptKey& key = script_.keys[k];
    const NominalStance& stance = stances_[k];
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < key.poses.size(); ++i) {
      // Small sets are tried in full: their poses differ more.
      if (key.poses.size() > 12 && static_cast<int>(i) % every != 0) continue;
      Candidate candidate;
      candidate.object = key.poses[i];
      if (!key.push.isZero(0.0)) candidate.cost += PushOff(grasp, key.push, candidate.object);
      candidate.world =
          key.anchor == Anchor::kHead ? stance.head * candidate.object : candidate.object;
      const std::array<bool, 2> holds = HoldersAt(script_, k);
      if (holds[0]) candidate.cost += ArmCost(Side::kRight, grasp.right, stance, candidate.world);
      if (holds[1]) candidate.cost += ArmCost(Side::kLeft, *grasp.left, stance, candidate.world);
      if (k == 0 && script_.table_m) {
        candidate.cost += TableCost(grasp.right, candidate.world, stance);
      }
      candidate.cost = std::min(candidate.cost, kWorst + 1e-3 * candidate.cost);
      candidates.push_back(candidate);
    }
    return candidates;
  }

  // Pushes the object, with the holding hand, off the head; returns the cost.
  double PushOff(const ActionGrasp& grasp, const Vector3d& direction, Isometry3d& object) const {
    double pushed = 0.0, depth = 0.0;
    for (int k = 0; k < kPushes; ++k) {
      const Isometry3d wrist = object * grasp.right.wrist_from_object.inverse();
      depth = std::max(DeepestIn(actor_.Head(), object, object_points_),
                       DeepestIn(actor_.Head(), wrist, grasp.right_skin));
      if (depth <= kTouch_m || pushed >= kFarPush_m) break;
      const double step = std::max(0.001, depth);
      object.translation() += step * direction.normalized();
      pushed += step;
    }
    return Square(std::max(0.0, pushed - 0.004) / 0.01) + Square(depth / 0.002);
  }

  double ArmCost(Side side, const Grasp& grasp, const NominalStance& stance,
                 const Isometry3d& object) const {
    const Isometry3d wrist = object * grasp.wrist_from_object.inverse();
    const ArmTarget target{stance.Shoulder(side), stance.chest, wrist};
    double least = std::numeric_limits<double>::infinity();
    for (const double swivel : {-5.0, 15.0, 35.0, 60.0}) {
      const ArmChoice arm = actor_.Arm(side).At(target, swivel * kDegree);
      const double shortfall = std::max(0.0, arm.shortfall_m - kEasyShortfall_m);
      least = std::min(least, arm.discomfort + Square(shortfall / 0.02));
    }
    // Hands close to the trunk push the elbow outwards.
    const Vector3d from_chest = wrist.translation() - stance.chest_position;
    const double near = std::max(0.0, 0.24 - from_chest.head<2>().norm());
    return least + Square(near / 0.05);
  }

  // Keeps hand and forearm above the table.
  double TableCost(const Grasp& grasp, const Isometry3d& object,
                   const NominalStance& stance) const {
    const Isometry3d wrist = object * grasp.wrist_from_object.inverse();
    const Vector3d shoulder = stance.Shoulder(Side::kRight);
    const double above = wrist.translation().z() - *script_.table_m;
    const Vector3d elbow =
        wrist.translation() +
        0.24 * (shoulder - Vector3d(0.05, -0.05, 0.25) - wrist.translation()).normalized();
    const double forearm = std::min(above - 0.03, elbow.z() - *script_.table_m - 0.02);
    return Square(grasp.below_bottom_mm / 3.0) + Square(std::max(0.0, -forearm) / 0.01);
  }

  static double WayCost(const Candidate& a, const Candidate& b,
                        const std::optional<double>& wanted) {
    const double angle = AngleBetween(a.world.linear(), b.world.linear());
    return wanted ? Square((angle - *wanted) / (15.0 * kDegree)) : Square(angle / (60.0 * kDegree));
  }

  const ActionActor& actor_;
  const ActionScript& script_;
  const Eigen::Matrix3Xd& object_points_;
  std::vector<NominalStance> stances_;
};

}  // namespace

std::array<bool, 2> HoldersAt(const ActionScript& script, int key) {
  if (!script.handover) return {true, false};
  return {key <= script.handover->key, key >= script.handover->key};
}

ActionChoice ChooseKeys(const ActionActor& actor, const BodyPlacement& start,
                        const ActionScript& script, std::span<const ActionGrasp> grasps,
                        std::span<const double> offsets, const Eigen::Matrix3Xd& object_points) {
  if (grasps.empty()) {
    throw Error("action", "has no grasp of the object", "Find grasps first");
  }
  const ActionKeySearch search(actor, start, script, object_points);
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < grasps.size(); ++g) {
    const double cost = search.Choose(grasps[g], 3).cost + offsets[g];
    if (cost < least) {
      least = cost;
      best = g;
    }
  }
  ActionChoice choice = search.Choose(grasps[best], 1);
  choice.grasp = best;
  return choice;
}

namespace {

constexpr double kAlike_m = 0.02, kAlike_rad = 20.0 * std::numbers::pi / 180.0;

// World up direction in the wrist's frame: thumb up, back of the hand up, and in between; fingers
// level, slightly up, or down.
std::vector<Vector3d> UpsInWrist(const HandAxes& axes) {
  const Vector3d back = -axes.PalmNormal();
  std::vector<Vector3d> ups;
  for (const Vector3d& up :
       {Vector3d(axes.Across()), Vector3d((axes.Across() + back).normalized()), back}) {
    for (const double tilt : {0.2, -0.15, -0.6}) {
      ups.push_back((up + tilt * axes.Forward()).normalized());
    }
  }
  return ups;
}

bool Alike(const Grasp& a, const Grasp& b) {
  const Isometry3d from = a.wrist_from_object.inverse(), to = b.wrist_from_object.inverse();
  return (from.translation() - to.translation()).norm() < kAlike_m &&
         AngleBetween(from.linear(), to.linear()) < kAlike_rad;
}

// Accepted candidates, best first, no two similar.
std::vector<Grasp> Differing(const GraspReport& report, int most) {
  std::vector<Grasp> kept;
  for (const GraspReport::Candidate& candidate : report.candidates) {
    if (!candidate.refused.empty() || static_cast<int>(kept.size()) == most) continue;
    const auto alike = [&](const Grasp& grasp) { return Alike(grasp, candidate.grasp); };
    if (std::ranges::none_of(kept, alike)) kept.push_back(candidate.grasp);
  }
  return kept;
}

}  // namespace

Eigen::Matrix3Xd SkinInWrist(const HandModel& hand, const FingerPose& fingers, int every) {
  HandState state(hand);
  state.SetBody(JointPose::Zero(), Vector3d::Zero());
  state.Evaluate(fingers, false);
  const Eigen::Matrix3d from_world = state.WristRotation().transpose();
  Eigen::Matrix3Xd skin(3, (state.Vertices().cols() + every - 1) / every);
  for (Eigen::Index i = 0; i < skin.cols(); ++i) {
    skin.col(i) = from_world * (state.Vertices().col(i * every) - state.WristPosition());
  }
  return skin;
}

std::vector<Grasp> FindActionGrasps(const HandModel& hand, const ActionProp& prop,
                                    std::uint64_t seed, int most, GraspStatus* status,
                                    int threads) {
  GraspOptions options;
  options.threads = threads;
  options.seed = seed;
  options.up_in_wrist = UpsInWrist(HandAxes(hand));
  options.upright_weight = 1.0;
  options.table_weight = 1.5;
  options.handle_weight = 0.5;  // handles are preferred, not required
  options.closings = 160;
  options.refinements = 36;
  GraspReport report;
  CloseHand(hand, prop.mesh, prop.surface, *prop.fit.distance, options, &report);
  if (status != nullptr) *status = report.status;
  return Differing(report, most);
}

std::vector<Grasp> FindToolGrips(const HandModel& hand, const ActionProp& prop, std::uint64_t seed,
                                 int most, int threads) {
  GraspOptions options;
  options.threads = threads;
  options.seed = seed;
  options.use = GraspUse::kTool;
  options.style = GraspStyle::kPower;
  options.table_weight = 0.0;
  GraspReport report;
  CloseHand(hand, prop.mesh, prop.surface, *prop.fit.distance, options, &report);
  std::vector<Grasp> grips = Differing(report, 4 * most);
  std::erase_if(grips, [](const Grasp& grasp) { return !grasp.palm_touching; });
  if (static_cast<int>(grips.size()) > most) grips.resize(static_cast<std::size_t>(most));
  return grips;
}

void AddTurnedOver(const ObjectMarks& marks, std::vector<Grasp>& grasps) {
  if (!marks.two_sided) return;
  const std::size_t count = grasps.size();
  for (std::size_t k = 0; k < count; ++k) {
    Grasp turned = grasps[k];
    turned.wrist_from_object = turned.wrist_from_object * TurnedOver();
    turned.certificate.reset();  // belongs to the original orientation
    grasps.push_back(std::move(turned));
  }
}

}  // namespace holdfast
