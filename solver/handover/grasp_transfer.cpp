// SPDX-License-Identifier: MIT
#include "solver/handover/grasp_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "geometry/error.h"
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

TriangleMesh Joined(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh joined;
  joined.vertices.resize(3, a.NumVertices() + b.NumVertices());
  joined.vertices << a.vertices, b.vertices;
  joined.faces.resize(3, a.NumFaces() + b.NumFaces());
  joined.faces << a.faces, (b.faces.array() + static_cast<int>(a.NumVertices())).matrix();
  return joined;
}

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
  Isometry3d reflected = Isometry3d::Identity();
  reflected.linear() = hand * wrist_from_object.linear() * plane;
  reflected.translation() =
      hand * (wrist_from_object.linear() * shift + wrist_from_object.translation());
  return reflected;
}

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
  const HandAnatomy anatomy(receiver);
  const GraspPlacer placer(anatomy);
  GraspOptions grasp_options;
  grasp_options.max_penetration_m = options.max_penetration_m;
  grasp_options.table_weight = 0.0;
  grasp_options.upright_weight = 0.0;
  grasp_options.seed = options.seed;
  const GraspScene scene(anatomy, placer, distance, object, grasp_options);
  const TriangleMesh giving = HandInObject(giver, giver_fingers, giver_from_object);
  const SignedDistance giving_surface(giving);
  DistanceGridOptions grid_options;
  grid_options.cell_m = kObstacleCell;
  grid_options.threads = options.threads;
  const DistanceGrid obstacles(SignedDistance(Joined(object, giving)), grid_options);
  const HandAngles mirrored = anatomy.axes.AnglesOf(MirrorFingers(giver_fingers));
  const HandAngles open = OpenHand(anatomy.axes);

  struct Candidate {
    TransferMethod method;
    Isometry3d wrist_from_object;
    HandAngles start;
    double correction;  // metres
  };
  // The object as a lever: how far the wrist is from where it was given.
  const auto correction_of = [&](const Isometry3d& wrist_from_object) {
    const Isometry3d moved = wrist_from_object.inverse() * receiver_from_object;
    return std::pair(
        (wrist_from_object.inverse().translation() - receiver_from_object.inverse().translation())
            .norm(),
        LogSO3(moved.linear()).norm());
  };
  const auto correction = [&](const Isometry3d& wrist_from_object) {
    const auto [metres, radians] = correction_of(wrist_from_object);
    return metres + options.lever_m * radians;
  };
  const auto overlap = [&](const Eigen::Matrix3Xd& vertices_in_object) {
    return std::max(0.0, -giving_surface.Distances(vertices_in_object).minCoeff());
  };

  const auto attempt = [&](const Candidate& candidate, bool against_giver) {
    HandEvaluation evaluation = AtWrist(receiver);
    GraspTransfer result;
    result.method = candidate.method;
    GraspAttempt closed;
    closed.style = GraspStyle::kPower;
    closed.wrist_from_object = candidate.wrist_from_object;
    closed.angles =
        CloseFingers(anatomy, evaluation, obstacles, candidate.wrist_from_object, candidate.start)
            .angles;
    RefineGrasp(anatomy, evaluation, against_giver ? obstacles : distance, {}, closed.angles,
                closed.wrist_from_object);
    // Settled against both, the object's own, finer grid has the last word.
    if (against_giver) {
      RefinementOptions last;
      last.rounds = 1;
      RefineGrasp(anatomy, evaluation, distance, last, closed.angles, closed.wrist_from_object);
    }
    result.grasp = Assess(scene, evaluation, closed, true);
    const Eigen::Matrix3Xd vertices = result.grasp.wrist_from_object.inverse() *
                                      evaluation.At(result.grasp.fingers.data(), false).Vertices();
    result.grasp.metrics =
        MeasureContact(TriangleMesh{vertices, receiver.Surface().Faces()}, surface);
    result.hand_overlap_mm = 1000.0 * overlap(vertices);
    std::tie(result.correction_m, result.correction_rad) =
        correction_of(result.grasp.wrist_from_object);

    // Directions that the thumb and the fingers press in.
    std::array<Vector3d, kNumFingers> inward;
    for (int finger = 0; finger < kNumFingers; ++finger) {
      inward[finger].setZero();
      double nearest = grasp_options.touch_distance_m;
      for (int part = 3 * finger + 1; part < 3 * finger + 3; ++part) {
        for (const int i : anatomy.landmarks.Pad(part)) {
          Vector3d gradient;
          const double d = distance.Distance(vertices.col(i), &gradient);
          if (d >= nearest || gradient.norm() < 1e-6) continue;
          nearest = d;
          inward[finger] = -gradient.normalized();
        }
      }
    }
    for (int finger = 0; finger < kThumb; ++finger) {
      result.thumb_opposition =
          std::max(result.thumb_opposition, -inward[kThumb].dot(inward[finger]));
    }

    result.refused = {};
    const std::string why = WhyRefused(scene, result.grasp);
    if (!why.empty()) result.refused = "it is no clean and firm grasp";
    if (result.grasp.metrics.max_penetration_mm > 1000.0 * options.max_penetration_m) {
      result.refused = "the hand goes into the object";
    }
    if (result.hand_overlap_mm > 1000.0 * options.max_hand_overlap_m) {
      result.refused = "the hands go into each other";
    }
    result.found = result.refused.empty();
    return result;
  };
  const auto value = [&](const GraspTransfer& result) {
    return result.grasp.score -
           options.correction_weight * correction(result.grasp.wrist_from_object) -
           0.2 * std::max(0.0, result.hand_overlap_mm - 1000.0 * options.max_hand_overlap_m);
  };
  GraspTransfer best;
  bool any = false;
  const auto keep = [&](const GraspTransfer& result) {
    const bool better =
        !any || (result.found != best.found ? result.found : value(result) > value(best));
    if (better) best = result;
    any = true;
  };

  // Where the clip has the wrist; the mirrored fingers opened by as much as frees them.
  for (const double opened : {0.35, 0.7, 1.0}) {
    Candidate candidate{TransferMethod::kMirrored, receiver_from_object,
                        anatomy.axes.Clamp(mirrored + opened * (open - mirrored)), 0.0};
    for (const bool against_giver : {false, true}) {
      const GraspTransfer result = attempt(candidate, against_giver);
      if (correction(result.grasp.wrist_from_object) < options.small_correction_m)
        keep(result);
      else if (!any)
        keep(result);
    }
    if (best.found) break;
  }
  if (best.found) return best;

  // Whole grasps: reflections of the giver's, and what the object has room for.
  std::vector<Candidate> candidates;
  for (const Vector3d& normal :
       SymmetryPlanes(scene.surface, distance, scene.centroid, scene.size)) {
    const Isometry3d reflected = Reflected(giver_from_object, normal, scene.centroid);
    candidates.push_back({TransferMethod::kReflected, reflected,
                          anatomy.axes.Clamp(mirrored + 0.35 * (open - mirrored)),
                          correction(reflected)});
  }
  OppositionOptions opposition_options;
  opposition_options.seed = options.seed;
  const std::vector<Opposition> oppositions =
      FindOppositions(object, distance, scene.centroid, opposition_options);
  if (!oppositions.empty()) {
    double thinnest = oppositions.front().width;
    for (const Opposition& opposition : oppositions) {
      thinnest = std::min(thinnest, opposition.width);
    }
    const GraspPlacer::Target target{distance, scene.size,
                                     std::clamp(0.2 * thinnest, 0.0005, 0.003)};
    constexpr int kTurns = 24;
    std::vector<std::vector<Placement>> placed(oppositions.size());
    ParallelFor(static_cast<int>(oppositions.size()), options.threads,
                [&](int i) { placed[i] = placer.Place(oppositions[i], target, kTurns); });
    for (const std::vector<Placement>& placements : placed) {
      for (const Placement& placement : placements) {
        candidates.push_back({TransferMethod::kPlaced, placement.wrist_from_object, placement.start,
                              correction(placement.wrist_from_object)});
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.correction < b.correction; });
  // The nearest that leave the giving hand room, open as they are.
  std::vector<Candidate> near;
  HandEvaluation evaluation = AtWrist(receiver);
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(near.size()) == kMostRounds * options.closings) break;
    const FingerPose fingers = anatomy.axes.PoseOf(candidate.start);
    const Eigen::Matrix3Xd vertices =
        candidate.wrist_from_object.inverse() * evaluation.At(fingers.data(), false).Vertices();
    if (overlap(vertices) > 0.0) continue;
    const bool is_new = std::none_of(near.begin(), near.end(), [&](const Candidate& other) {
      const Isometry3d apart = other.wrist_from_object.inverse() * candidate.wrist_from_object;
      return apart.translation().norm() + options.lever_m * LogSO3(apart.linear()).norm() <
             kNeighbour;
    });
    if (is_new) near.push_back(candidate);
  }
  // Farther ones only where none of the nearer is any good.
  for (int round = 0; round < kMostRounds && !best.found; ++round) {
    const int begin = round * options.closings;
    const int count = std::min(options.closings, static_cast<int>(near.size()) - begin);
    if (count <= 0) break;
    std::vector<GraspTransfer> results(static_cast<std::size_t>(count));
    ParallelFor(count, options.threads, [&](int i) {
      results[i] = attempt(near[begin + i], false);
      if (results[i].hand_overlap_mm <= 1000.0 * options.max_hand_overlap_m) return;
      const GraspTransfer clear = attempt(near[begin + i], true);
      if (clear.hand_overlap_mm < results[i].hand_overlap_mm) results[i] = clear;
    });
    for (const GraspTransfer& result : results) keep(result);
  }
  return best;
}

}  // namespace holdfast
