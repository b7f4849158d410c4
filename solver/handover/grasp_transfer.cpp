// SPDX-License-Identifier: MIT
#include "solver/handover/grasp_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "geometry/error.h"
#include "geometry/mesh/append.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_refinement.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMostRounds = 5;
constexpr double kNeighbour = 0.012;     // metres: candidates nearer to each other are one
constexpr double kObstacleCell = 0.004;  // metres, of the grid that fingers close against

// Closed mesh of a hand in the object's frame.
TriangleMesh HandInObject(const HandModel& hand, const FingerPose& fingers,
                          const Isometry3d& wrist_from_object) {
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd vertices =
      wrist_from_object.inverse() * evaluation.At(fingers.data(), false).Vertices();
  return CloseHoles({vertices, hand.Surface().Faces()});
}

// Planes through `centroid` that the object is its own mirror image about, as unit normals.
std::vector<Vector3d> SymmetryPlanes(const Eigen::Matrix3Xd& surface, const DistanceGrid& object,
                                     const Vector3d& centroid, double size) {
  constexpr int kDirections = 96;
  const double allowed = std::max(0.0012, 0.015 * size);
  std::vector<Vector3d> directions = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (int k = 0; k < kDirections; ++k) {  // evenly over a half sphere
    const double z = (k + 0.5) / kDirections;
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * k;
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  for (int k = 1; k < 24; ++k) {  // what stands is often round about z
    const double angle = std::numbers::pi * k / 24.0;
    directions.emplace_back(std::cos(angle), std::sin(angle), 0.0);
  }
  std::vector<Vector3d> planes;
  for (const Vector3d& n : directions) {
    double worst = 0.0;
    for (Eigen::Index i = 0; i < surface.cols() && worst < allowed; i += 16) {
      const Vector3d x = surface.col(i);
      worst = std::max(worst, std::abs(object.Distance(x - 2.0 * n.dot(x - centroid) * n)));
    }
    if (worst < allowed) planes.push_back(n);
  }
  return planes;
}

// The grasp of the one hand as the other hand's, seen in a mirror that the object does not change
// in: the hand's mirror is x of the wrist's frame, the object's the plane.
Isometry3d Reflected(const Isometry3d& wrist_from_object, const Vector3d& normal,
                     const Vector3d& centroid) {
  const Matrix3d hand = Vector3d(-1.0, 1.0, 1.0).asDiagonal();
  const Matrix3d plane = Matrix3d::Identity() - 2.0 * normal * normal.transpose();
  const Vector3d shift = 2.0 * normal.dot(centroid) * normal;
  return RigidTransform(
      hand * wrist_from_object.linear() * plane,
      hand * (wrist_from_object.linear() * shift + wrist_from_object.translation()));
}

// Directions that each finger's pads press in where they touch; zero of those that do not.
std::array<Vector3d, kNumFingers> PressingDirections(const HandLandmarks& landmarks,
                                                     const Eigen::Matrix3Xd& vertices,
                                                     const DistanceGrid& object,
                                                     double touch_distance_m) {
  std::array<Vector3d, kNumFingers> inward;
  for (int finger = 0; finger < kNumFingers; ++finger) {
    inward[finger].setZero();
    double nearest = touch_distance_m;
    for (int part = 3 * finger + 1; part < 3 * finger + 3; ++part) {
      for (const int i : landmarks.Pad(part)) {
        Vector3d gradient;
        const double d = object.Distance(vertices.col(i), &gradient);
        if (d >= nearest || gradient.norm() < 1e-6) continue;
        nearest = d;
        inward[finger] = -gradient.normalized();
      }
    }
  }
  return inward;
}

double ThumbOpposition(const std::array<Vector3d, kNumFingers>& inward) {
  double most = 0.0;
  for (int finger = 0; finger < kThumb; ++finger) {
    most = std::max(most, -inward[kThumb].dot(inward[finger]));
  }
  return most;
}

GraspOptions OptionsOfGrasp(const GraspTransferOptions& options) {
  GraspOptions grasp;
  grasp.max_penetration_m = options.max_penetration_m;
  grasp.table_weight = 0.0;
  grasp.upright_weight = 0.0;
  grasp.seed = options.seed;
  grasp.place = options.place;
  return grasp;
}

DistanceGrid ObstacleGrid(const TriangleMesh& object, const TriangleMesh& giving, int threads) {
  DistanceGridOptions options;
  options.cell_m = kObstacleCell;
  options.threads = threads;
  TriangleMesh both = object;
  Append(giving, both);
  return DistanceGrid(SignedDistance(both), options);
}

// One search for the receiving hand's grasp, from what is nearest to the clip to what is farther.
class TransferSearch {
 public:
  TransferSearch(const HandModel& giver, const FingerPose& giver_fingers,
                 const Isometry3d& giver_from_object, const HandModel& receiver,
                 const Isometry3d& receiver_from_object, const TriangleMesh& object,
                 const SignedDistance& surface, const DistanceGrid& distance,
                 const GraspTransferOptions& options)
      : receiver_(receiver),
        giver_from_object_(giver_from_object),
        receiver_from_object_(receiver_from_object),
        object_(object),
        surface_(surface),
        distance_(distance),
        options_(options),
        grasp_options_(OptionsOfGrasp(options)),
        anatomy_(receiver),
        placer_(anatomy_),
        scene_(anatomy_, placer_, distance, object, grasp_options_),
        giving_(HandInObject(giver, giver_fingers, giver_from_object)),
        giving_surface_(giving_),
        obstacles_(ObstacleGrid(object, giving_, options.threads)),
        mirrored_(anatomy_.axes.AnglesOf(MirrorFingers(giver_fingers))),
        open_(OpenHand(anatomy_.axes)) {}

  GraspTransfer Run() {
    TryMirroredFingers();
    if (!best_.found) TryWholeGrasps();
    return best_;
  }

 private:
  struct Candidate {
    TransferMethod method;
    Isometry3d wrist_from_object;
    HandAngles start;
    double correction;  // metres
  };

  // How far the wrist is from where it was given: metres and radians.
  std::pair<double, double> CorrectionOf(const Isometry3d& wrist_from_object) const {
    const Isometry3d moved = wrist_from_object.inverse() * receiver_from_object_;
    return {
        (wrist_from_object.inverse().translation() - receiver_from_object_.inverse().translation())
            .norm(),
        LogSO3(moved.linear()).norm()};
  }

  // Both in one, the object as a lever.
  double Correction(const Isometry3d& wrist_from_object) const {
    const auto [metres, radians] = CorrectionOf(wrist_from_object);
    return metres + options_.lever_m * radians;
  }

  double Overlap(const Eigen::Matrix3Xd& vertices_in_object) const {
    return std::max(0.0, -giving_surface_.Distances(vertices_in_object).minCoeff());
  }

  double Value(const GraspTransfer& result) const {
    return result.grasp.score -
           options_.correction_weight * Correction(result.grasp.wrist_from_object) -
           0.2 * std::max(0.0, result.hand_overlap_mm - 1000.0 * options_.max_hand_overlap_m);
  }

  void Keep(const GraspTransfer& result) {
    const bool better =
        !any_ || (result.found != best_.found ? result.found : Value(result) > Value(best_));
    if (better) best_ = result;
    any_ = true;
  }

  GraspAttempt Closed(const Candidate& candidate, bool against_giver,
                      HandEvaluation& evaluation) const {
    GraspAttempt closed;
    closed.style = GraspStyle::kPower;
    closed.wrist_from_object = candidate.wrist_from_object;
    closed.angles =
        CloseFingers(anatomy_, evaluation, obstacles_, candidate.wrist_from_object, candidate.start)
            .angles;
    RefineGrasp(anatomy_, evaluation, against_giver ? obstacles_ : distance_, {}, closed.angles,
                closed.wrist_from_object);
    // Refined against both, the object's own, finer grid has the last word.
    if (against_giver) {
      RefinementOptions last;
      last.rounds = 1;
      RefineGrasp(anatomy_, evaluation, distance_, last, closed.angles, closed.wrist_from_object);
    }
    return closed;
  }

  std::string_view WhyNot(const GraspTransfer& result) const {
    if (result.hand_overlap_mm > 1000.0 * options_.max_hand_overlap_m) {
      return "the hands go into each other";
    }
    if (result.grasp.metrics.max_penetration_mm > 1000.0 * options_.max_penetration_m) {
      return "the hand goes into the object";
    }
    if (result.grasp.outside_place > GraspPlace::kMostOutside) {
      return "it touches what is not to be touched";
    }
    return WhyRefused(scene_, result.grasp).empty() ? "" : "it is not a clean and firm grasp";
  }

  GraspTransfer Attempt(const Candidate& candidate, bool against_giver) const {
    HandEvaluation evaluation = AtWrist(receiver_);
    const GraspAttempt closed = Closed(candidate, against_giver, evaluation);
    GraspTransfer result;
    result.method = candidate.method;
    result.grasp = Assess(scene_, evaluation, closed, true);
    const Eigen::Matrix3Xd vertices = result.grasp.wrist_from_object.inverse() *
                                      evaluation.At(result.grasp.fingers.data(), false).Vertices();
    result.grasp.metrics =
        MeasureContact(TriangleMesh{vertices, receiver_.Surface().Faces()}, surface_);
    result.hand_overlap_mm = 1000.0 * Overlap(vertices);
    std::tie(result.correction_m, result.correction_rad) =
        CorrectionOf(result.grasp.wrist_from_object);
    result.thumb_opposition = ThumbOpposition(PressingDirections(
        anatomy_.landmarks, vertices, distance_, grasp_options_.touch_distance_m));
    result.refused = WhyNot(result);
    result.found = result.refused.empty();
    return result;
  }

  // Where the clip has the wrist; the mirrored fingers opened by as much as frees them.
  void TryMirroredFingers() {
    for (const double opened : {0.35, 0.7, 1.0}) {
      const Candidate candidate{TransferMethod::kMirrored, receiver_from_object_,
                                anatomy_.axes.Clamp(mirrored_ + opened * (open_ - mirrored_)), 0.0};
      for (const bool against_giver : {false, true}) {
        const GraspTransfer result = Attempt(candidate, against_giver);
        const bool near = Correction(result.grasp.wrist_from_object) < options_.small_correction_m;
        if (near || !any_) Keep(result);
      }
      if (best_.found) return;
    }
  }

  // Reflections of the giver's, and what the object has room for, nearest first.
  std::vector<Candidate> WholeGrasps() const {
    std::vector<Candidate> candidates;
    for (const Vector3d& normal :
         SymmetryPlanes(scene_.surface, distance_, scene_.centroid, scene_.size)) {
      const Isometry3d reflected = Reflected(giver_from_object_, normal, scene_.centroid);
      candidates.push_back({TransferMethod::kReflected, reflected,
                            anatomy_.axes.Clamp(mirrored_ + 0.35 * (open_ - mirrored_)),
                            Correction(reflected)});
    }
    OppositionOptions opposition_options;
    opposition_options.seed = options_.seed;
    const GraspPlace* place = options_.place.get();
    if (place != nullptr) {
      opposition_options.allowed = [place](const Vector3d& x) { return place->Allows(x); };
    }
    const std::vector<Opposition> oppositions =
        FindOppositions(place != nullptr ? place->Surface() : object_, distance_, scene_.held_at,
                        opposition_options);
    double thinnest = std::numeric_limits<double>::infinity();
    for (const Opposition& opposition : oppositions) {
      thinnest = std::min(thinnest, opposition.width);
    }
    const GraspPlacer::Target target{distance_, scene_.size,
                                     std::clamp(0.2 * thinnest, 0.0005, 0.003)};
    constexpr int kTurns = 24;
    std::vector<std::vector<Placement>> placed(oppositions.size());
    ParallelFor(static_cast<int>(oppositions.size()), options_.threads,
                [&](int i) { placed[i] = placer_.Place(oppositions[i], target, kTurns); });
    for (const std::vector<Placement>& placements : placed) {
      for (const Placement& placement : placements) {
        candidates.push_back({TransferMethod::kPlaced, placement.wrist_from_object, placement.start,
                              Correction(placement.wrist_from_object)});
      }
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.correction < b.correction; });
    return candidates;
  }

  // The nearest that leave the giving hand room, open as they are.
  std::vector<Candidate> NearAndFree(const std::vector<Candidate>& candidates) const {
    std::vector<Candidate> near;
    HandEvaluation evaluation = AtWrist(receiver_);
    for (const Candidate& candidate : candidates) {
      if (static_cast<int>(near.size()) == kMostRounds * options_.closings) break;
      const FingerPose fingers = anatomy_.axes.PoseOf(candidate.start);
      const Eigen::Matrix3Xd vertices =
          candidate.wrist_from_object.inverse() * evaluation.At(fingers.data(), false).Vertices();
      if (Overlap(vertices) > 0.0) continue;
      const bool is_new = std::none_of(near.begin(), near.end(), [&](const Candidate& other) {
        const Isometry3d apart = other.wrist_from_object.inverse() * candidate.wrist_from_object;
        return apart.translation().norm() + options_.lever_m * LogSO3(apart.linear()).norm() <
               kNeighbour;
      });
      if (is_new) near.push_back(candidate);
    }
    return near;
  }

  // Farther ones only where none of the nearer is any good.
  void TryWholeGrasps() {
    const std::vector<Candidate> near = NearAndFree(WholeGrasps());
    for (int round = 0; round < kMostRounds && !best_.found; ++round) {
      const int begin = round * options_.closings;
      const int count = std::min(options_.closings, static_cast<int>(near.size()) - begin);
      if (count <= 0) break;
      std::vector<GraspTransfer> results(static_cast<std::size_t>(count));
      ParallelFor(count, options_.threads, [&](int i) {
        results[i] = Attempt(near[begin + i], false);
        if (results[i].hand_overlap_mm <= 1000.0 * options_.max_hand_overlap_m) return;
        const GraspTransfer clear = Attempt(near[begin + i], true);
        if (clear.hand_overlap_mm < results[i].hand_overlap_mm) results[i] = clear;
      });
      for (const GraspTransfer& result : results) Keep(result);
    }
  }

  const HandModel& receiver_;
  const Isometry3d& giver_from_object_;
  const Isometry3d& receiver_from_object_;
  const TriangleMesh& object_;
  const SignedDistance& surface_;
  const DistanceGrid& distance_;
  const GraspTransferOptions& options_;
  GraspOptions grasp_options_;
  HandAnatomy anatomy_;
  GraspPlacer placer_;
  GraspScene scene_;
  TriangleMesh giving_;
  SignedDistance giving_surface_;
  DistanceGrid obstacles_;
  HandAngles mirrored_, open_;
  GraspTransfer best_;
  bool any_ = false;
};

}  // namespace

std::string_view MethodName(TransferMethod method) {
  switch (method) {
    case TransferMethod::kMirrored:
      return "mirrored";
    case TransferMethod::kReflected:
      return "reflected";
    case TransferMethod::kPlaced:
      return "placed";
  }
  return "";
}

FingerPose MirrorFingers(const FingerPose& fingers) {
  FingerPose mirrored = fingers;
  for (int k = 0; k < kJointsPerHand; ++k) mirrored.segment<2>(3 * k + 1) *= -1.0;
  return mirrored;
}

GraspTransfer TransferGrasp(const HandModel& giver, const FingerPose& giver_fingers,
                            const Isometry3d& giver_from_object, const HandModel& receiver,
                            const Isometry3d& receiver_from_object, const TriangleMesh& object,
                            const SignedDistance& surface, const DistanceGrid& distance,
                            const GraspTransferOptions& options) {
  if (giver.HandSide() == receiver.HandSide()) {
    throw Error("grasp transfer", "both hands are of one side", "Give a right and a left hand.");
  }
  return TransferSearch(giver, giver_fingers, giver_from_object, receiver, receiver_from_object,
                        object, surface, distance, options)
      .Run();
}

}  // namespace holdfast
