// SPDX-License-Identifier: MIT
#include "solver/carry/cup_in_hand.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_stages.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kStep_m = 0.01;
constexpr int kBack = 6, kAhead = 3, kAside = 4;  // search steps from the center of the pads
constexpr int kTurns = 8;                         // for objects that are not round
constexpr std::size_t kFinished = 12;
constexpr double kRound_m = 0.002;
constexpr double kMaxDeep_m = 0.0006;  // of an open hand: walls are thin
constexpr double kFilled = 0.6;        // fraction of the height, from the rim, without hands

class StandingHold {
 public:
  StandingHold(const HandModel& hand, const HandAtTable& at, const PreparedObject& object,
               const ObjectMarks& marks, std::uint64_t seed)
      : at_(at),
        marks_(marks),
        grid_(*object.fit.distance),
        options_(OptionsOf(at, seed)),
        anatomy_(hand),
        placer_(anatomy_),
        scene_(anatomy_, placer_, grid_, object.object.mesh, options_),
        evaluation_(AtWrist(hand)),
        low_(object.object.mesh.vertices.row(2).minCoeff()) {
    scene_.TakeFor(FindUse(object.object.mesh, grid_, {}, {}));
  }

  Grasp Find(GraspStatus& status) {
    std::vector<GraspAttempt> attempts = Closed();
    std::ranges::stable_sort(attempts, std::greater(), &GraspAttempt::rank);
    attempts.resize(std::min(attempts.size(), kFinished));
    status = GraspStatus::kNoRoom;
    Grasp best;
    int best_class = -1;
    for (GraspAttempt& attempt : attempts) {
      RefineGrasp(anatomy_, evaluation_, grid_, {}, attempt.angles, attempt.wrist_from_object);
      Grasp grasp = Assess(scene_, evaluation_, attempt, true);
      grasp.score += Also(attempt);
      const int its_class = Class(grasp);
      if (its_class < best_class || (its_class == best_class && grasp.score <= best.score)) {
        continue;
      }
      best = grasp;
      best_class = its_class;
      status = its_class == kClean ? GraspStatus::kFound : GraspStatus::kNoCleanGrasp;
    }
    return best;
  }

 private:
  // Penetrating grasps are the last choice: the fit would rotate the hand about the cup to resolve
  // them, and the cup would tilt. A loose grasp only has to hold what it lifts.
  enum { kThrough, kLoose, kClean };
  int Class(const Grasp& grasp) const {
    if (WhyRefused(scene_, grasp).empty()) return kClean;
    return WhyThrough(scene_, grasp).empty() ? kLoose : kThrough;
  }

  static GraspOptions OptionsOf(const HandAtTable& at, std::uint64_t seed) {
    GraspOptions options;
    options.seed = seed;
    options.up_in_wrist = {at.up};
    return options;
  }

  // Hands closed around the object wherever an open hand fits.
  std::vector<GraspAttempt> Closed() {
    const Vector3d ahead =
        (anatomy_.axes.Forward() - anatomy_.axes.Forward().dot(at_.up) * at_.up).normalized();
    const Vector3d aside = at_.up.cross(ahead);
    const double width = 2.0 * marks_.rim_radius;
    const std::vector<HandAngles> starts = {
        PinchHand(anatomy_, std::clamp(width + 0.012, 0.03, 0.1)), OpenHand(anatomy_.axes)};
    const int turns = std::abs(marks_.size.x() - marks_.size.y()) < kRound_m ? 1 : kTurns;
    std::vector<GraspAttempt> attempts;
    for (const HandAngles& start : starts) {
      const FingerPose open = anatomy_.axes.PoseOf(start);
      const Matrix3Xd skin = evaluation_.At(open.data(), false).Vertices();
      for (int i = -kBack; i <= kAhead; ++i) {
        for (int j = -kAside; j <= kAside; ++j) {
          for (int turn = 0; turn < turns; ++turn) {
            const Isometry3d wrist_from_object =
                Stand(at_.between + kStep_m * (i * ahead + j * aside), ahead,
                      2.0 * std::numbers::pi * turn / turns);
            if (!HasRoom(skin, wrist_from_object)) continue;
            GraspAttempt attempt;
            attempt.angles = CloseFingers(anatomy_, evaluation_, grid_, wrist_from_object, start,
                                          kAllFingers, kMaxDeep_m)
                                 .angles;
            attempt.wrist_from_object = wrist_from_object;
            attempt.rank = Assess(scene_, evaluation_, attempt, false).score + Also(attempt);
            attempts.push_back(attempt);
          }
        }
      }
    }
    return attempts;
  }

  double Also(const GraspAttempt& attempt) {
    const FingerPose fingers = anatomy_.axes.PoseOf(attempt.angles);
    return at_.also(attempt.wrist_from_object, evaluation_.At(fingers.data(), false).Vertices());
  }

  // On the table with the center of its rim above `place`.
  Isometry3d Stand(const Vector3d& place, const Vector3d& ahead, double turn) const {
    Matrix3d R;
    R << ahead, at_.up.cross(ahead), at_.up;
    R = R * Eigen::AngleAxisd(turn, Vector3d::UnitZ());
    const Vector3d bottom = place + (at_.table_m - place.dot(at_.up)) * at_.up;
    return RigidTransform(R, bottom - R * Vector3d(marks_.rim.x(), marks_.rim.y(), low_));
  }

  bool HasRoom(const Matrix3Xd& skin, const Isometry3d& wrist_from_object) const {
    const Isometry3d object_from_wrist = wrist_from_object.inverse();
    for (Eigen::Index i = 0; i < skin.cols(); i += 2) {
      const Vector3d x = object_from_wrist * Vector3d(skin.col(i));
      if (grid_.Linear(x) < -kMaxDeep_m) return false;
      const bool high =
          x.z() > marks_.rim.z() - kFilled * marks_.size.z() && x.z() < marks_.rim.z();
      if (high && (x - marks_.rim).head<2>().norm() < marks_.rim_radius) return false;
    }
    return placer_.ForearmClear(grid_, wrist_from_object);
  }

  const HandAtTable& at_;
  const ObjectMarks& marks_;
  const DistanceGrid& grid_;
  const GraspOptions options_;
  const HandAnatomy anatomy_;
  const GraspPlacer placer_;
  GraspScene scene_;
  HandEvaluation evaluation_;
  double low_;
};

}  // namespace

Grasp HoldStanding(const HandModel& hand, const HandAtTable& at, const PreparedObject& object,
                   const ObjectMarks& marks, std::uint64_t seed, GraspStatus& status) {
  return StandingHold(hand, at, object, marks, seed).Find(status);
}

}  // namespace holdfast
