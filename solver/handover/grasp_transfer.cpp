// SPDX-License-Identifier: MIT
#include "solver/handover/grasp_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "geometry/error.h"
#include "geometry/mesh/mesh.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_stages.h"
#include "solver/handover/grasps_by_transfer.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMaxRounds = 5;
constexpr double kNeighbor = 0.012;      // meters: nearer candidates count as one
constexpr double kBallsFree = 0.002;     // meters: allowed overlap of the balls of two hands
constexpr double kObstacleCell = 0.004;  // meters, of the grid for closing fingers

// Closed mesh of a hand in the object frame.
TriangleMesh HandInObject(const HandModel& hand, const FingerPose& fingers,
                          const Isometry3d& wrist_from_object) {
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd vertices =
      wrist_from_object.inverse() * evaluation.At(fingers.data(), false).Vertices();
  return CloseHoles({vertices, hand.Surface().Faces()});
}

// Symmetry planes of the object through `centroid`, as unit normals.
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
  for (int k = 1; k < 24; ++k) {  // standing objects are often round about z
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

// Mirrors a grasp of one hand to the other hand by a symmetry of the object: the hand is mirrored
// in x of the wrist frame, the object in the plane.
Isometry3d Reflected(const Isometry3d& wrist_from_object, const Vector3d& normal,
                     const Vector3d& centroid) {
  const Matrix3d hand = Vector3d(-1.0, 1.0, 1.0).asDiagonal();
  const Matrix3d plane = Matrix3d::Identity() - 2.0 * normal * normal.transpose();
  const Vector3d shift = 2.0 * normal.dot(centroid) * normal;
  return RigidTransform(
      hand * wrist_from_object.linear() * plane,
      hand * (wrist_from_object.linear() * shift + wrist_from_object.translation()));
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
  TriangleMesh both = object;
  Append(giving, both);
  return DistanceGrid(SignedDistance(both), {.cell_m = kObstacleCell, .threads = threads});
}

// Maximum overlap of two hands' balls, meters; negative: their distance.
double BallOverlap(const Eigen::Matrix4Xd& a, const Eigen::Matrix4Xd& b) {
  double deepest = -1.0;
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      const double radii = a(3, i) + b(3, j);
      const double squared = (a.col(i).head<3>() - b.col(j).head<3>()).squaredNorm();
      if (squared < (radii - deepest) * (radii - deepest)) deepest = radii - std::sqrt(squared);
    }
  }
  return deepest;
}

std::vector<int> AllOf(const Eigen::Matrix3Xd& points) {
  std::vector<int> ids(static_cast<std::size_t>(points.cols()));
  std::iota(ids.begin(), ids.end(), 0);
  return ids;
}

// Correction of the wrist from its given pose: meters and radians.
std::pair<double, double> CorrectionOf(const Isometry3d& wrist_from_object,
                                       const Isometry3d& given) {
  const Isometry3d moved = wrist_from_object.inverse() * given;
  return {(wrist_from_object.inverse().translation() - given.inverse().translation()).norm(),
          LogSO3(moved.linear()).norm()};
}

}  // namespace

// The receiving hand and the object, independent of giver and moment.
struct TransferScene {
  // A candidate placement of the open hand.
  struct WholeGrasp {
    std::string_view method;
    Isometry3d wrist_from_object;
    HandAngles start;
    int balls = -1;           // index into the scene's `balls` of the open hand; -1: none
    double correction = 0.0;  // meters
  };

  TransferScene(const HandModel& hand, const TriangleMesh& mesh,
                const SignedDistance& signed_distance, const DistanceGrid& grid,
                const GraspTransferOptions& transfer_options)
      : receiver(hand),
        object(mesh),
        surface(signed_distance),
        distance(grid),
        options(transfer_options),
        grasp_options(OptionsOfGrasp(options)),
        anatomy(receiver),
        placer(anatomy),
        scene(anatomy, placer, distance, object, grasp_options),
        open(OpenHand(anatomy.axes)),
        planes(SymmetryPlanes(scene.surface, distance, scene.centroid, scene.size)) {
    for (int part = 0; part < kNumHandParts; ++part) {
      if (part != kPalmPart && part / 3 == kThumb) continue;
      const std::vector<int>& pad = anatomy.landmarks.Pad(part);
      palm_side.insert(palm_side.end(), pad.begin(), pad.end());
    }
    HandEvaluation evaluation = AtWrist(receiver);
    constexpr double kThumbs[][2] = {{-15.0, 25.0}, {-20.0, 50.0}, {-20.0, 0.0}};
    for (const auto& [flexion, abduction] : kThumbs) {
      HandAngles angles = open;
      angles(0, 3 * kThumb) = flexion * kDegree;
      angles(1, 3 * kThumb) = abduction * kDegree;
      open_hands.push_back(anatomy.axes.Clamp(angles));
      const FingerPose fingers = anatomy.axes.PoseOf(open_hands.back());
      open_skin.push_back(evaluation.At(fingers.data(), false).Vertices());
    }
    Place();
  }

  // Adds all placements that the object allows (FindOppositions, GraspPlacer).
  void Place() {
    OppositionOptions opposition_options;
    opposition_options.seed = options.seed;
    const GraspPlace* where = options.place.get();
    if (where != nullptr) {
      opposition_options.allowed = [where](const Vector3d& x) { return where->Allows(x); };
    }
    const std::vector<Opposition> oppositions = FindOppositions(
        where != nullptr ? where->Surface() : object, distance, scene.held_at, opposition_options);
    double thinnest = std::numeric_limits<double>::infinity();
    for (const Opposition& opposition : oppositions) {
      thinnest = std::min(thinnest, opposition.width);
    }
    const GraspPlacer::Target target{distance, scene.size,
                                     std::clamp(0.2 * thinnest, 0.0005, 0.003)};
    constexpr int kTurns = 16;
    std::vector<std::vector<Placement>> found(oppositions.size());
    ParallelFor(static_cast<int>(oppositions.size()), options.threads,
                [&](int i) { found[i] = placer.Place(oppositions[i], target, kTurns); });
    for (const std::vector<Placement>& placements : found) {
      for (const Placement& placement : placements) {
        placed.push_back(
            {"placed", placement.wrist_from_object, placement.start, BallsOf(placement.start)});
      }
    }
  }

  int BallsOf(const HandAngles& start) {
    for (std::size_t k = 0; k < starts.size(); ++k) {
      if (starts[k] == start) return static_cast<int>(k);
    }
    starts.push_back(start);
    balls.push_back(HandBalls(anatomy, anatomy.axes.PoseOf(start)));
    return static_cast<int>(starts.size()) - 1;
  }

  double Correction(const Isometry3d& wrist_from_object, const Isometry3d& given) const {
    const auto [meters, radians] = CorrectionOf(wrist_from_object, given);
    return meters + options.lever_m * radians;
  }

  const HandModel& receiver;
  const TriangleMesh& object;
  const SignedDistance& surface;
  const DistanceGrid& distance;
  GraspTransferOptions options;
  GraspOptions grasp_options;
  HandAnatomy anatomy;
  GraspPlacer placer;
  GraspScene scene;
  HandAngles open;
  std::vector<Vector3d> planes;
  std::vector<int> palm_side;  // skin that meets an object first
  std::vector<HandAngles> open_hands;
  std::vector<Eigen::Matrix3Xd> open_skin;  // vertices, wrist frame
  std::vector<WholeGrasp> placed;
  std::vector<HandAngles> starts;
  std::vector<Eigen::Matrix4Xd> balls;  // of the hands at `starts`
};

namespace {

// One search for the receiving hand's grasp, from candidates near the clip's wrist to farther ones.
class TransferSearch {
  using WholeGrasp = TransferScene::WholeGrasp;

 public:
  TransferSearch(const TransferScene& prepared, const HandModel& giver,
                 const FingerPose& giver_fingers, const Isometry3d& giver_from_object,
                 const Isometry3d& receiver_from_object)
      : own_(prepared),
        options_(prepared.options),
        giver_from_object_(giver_from_object),
        receiver_from_object_(receiver_from_object),
        giving_(HandInObject(giver, giver_fingers, giver_from_object)),
        mirrored_(own_.anatomy.axes.AnglesOf(MirrorFingers(giver_fingers))) {
    ParallelFor(2, options_.threads, [&](int part) {
      if (part == 0) {
        obstacles_.emplace(ObstacleGrid(prepared.object, giving_, options_.threads));
      } else {
        giving_surface_.emplace(giving_);
        giving_patches_ = PointPatches(giving_.vertices, AllOf(giving_.vertices));
        giving_balls_ =
            MovedBalls(giver_from_object.inverse(), HandBalls(HandAnatomy(giver), giver_fingers));
      }
    });
  }

  GraspTransfer Run() {
    TryMirroredFingers();
    if (!best_.found) TryWholeGrasps();
    HandEvaluation evaluation = AtWrist(own_.receiver);
    best_.grasp.metrics = MeasureContact(
        TriangleMesh{InObject(best_.grasp, evaluation), own_.receiver.Surface().Faces()},
        own_.surface, {.threads = options_.threads});
    return best_;
  }

 private:
  double Correction(const Isometry3d& wrist_from_object) const {
    return own_.Correction(wrist_from_object, receiver_from_object_);
  }

  static Eigen::Matrix3Xd InObject(const Grasp& grasp, HandEvaluation& evaluation) {
    return grasp.wrist_from_object.inverse() *
           evaluation.At(grasp.fingers.data(), false).Vertices();
  }

  // Depth of the deepest point in a solid; only points that `may_be_inside` are tested.
  template <typename MayBeInside>
  static double Deepest(const SignedDistance& solid, const Eigen::Matrix3Xd& points,
                        const MayBeInside& may_be_inside) {
    const bool closed = solid.IsWatertight();
    double deepest = 0.0, last_distance = 0.0;
    Vector3d last = Vector3d::Zero();
    int face = -1;
    for (const auto& point : points.colwise()) {
      // The distance to a closed surface changes by at most the displacement of the point.
      if (closed && face >= 0 && last_distance - (point - last).norm() >= -deepest) continue;
      if (!may_be_inside(point)) continue;
      const SignedDistance::Result nearest = solid.Query(point, face);
      face = nearest.face;
      last = point;
      last_distance = nearest.distance;
      deepest = std::max(deepest, -nearest.distance);
    }
    return deepest;
  }

  double Overlap(const Eigen::Matrix3Xd& vertices_in_object) const {
    const Eigen::AlignedBox3d box(giving_surface_->Min(), giving_surface_->Max());
    return Deepest(*giving_surface_, vertices_in_object,
                   [&](const Vector3d& x) { return box.contains(x); });
  }

  double DepthInObject(const Eigen::Matrix3Xd& vertices_in_object) const {
    const double off = 2.0 * own_.distance.CellSize();  // maximum error of interpolated distances
    return Deepest(own_.surface, vertices_in_object,
                   [&](const Vector3d& x) { return own_.distance.Linear(x) < off; });
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

  GraspAttempt Closed(const WholeGrasp& candidate, HandEvaluation& evaluation) const {
    GraspAttempt closed;
    closed.style = GraspStyle::kPower;
    closed.wrist_from_object = candidate.wrist_from_object;
    closed.angles = CloseFingers(own_.anatomy, evaluation, *obstacles_, candidate.wrist_from_object,
                                 candidate.start)
                        .angles;
    return closed;
  }

  // Adds points (object frame) that are deeper than `soft_m` in the receiving hand, for the skin to
  // be moved back over them by the rest.
  void AddIntrusions(const Eigen::Matrix3Xd& vertices, const Isometry3d& wrist_from_object,
                     const Eigen::Matrix3Xd& points, const PointPatches& patches, double soft_m,
                     std::vector<Intrusion>& intrusions) const {
    const Isometry3d object_from_wrist = wrist_from_object.inverse();
    for (ClosedHands::Inside& in :
         own_.scene.hands.FindInside(vertices, wrist_from_object * points, patches)) {
      if (in.depth <= soft_m || std::ranges::max(in.over.corners) >= own_.receiver.NumVertices()) {
        continue;
      }
      in.over.point = object_from_wrist * (in.over.point + soft_m * in.over.outward);
      intrusions.push_back(in.over);
    }
  }

  // With `pushed_out`, refines against the giving hand too; then again on the object's own finer
  // grid, pushing out thin walls and the giving hand, which counts as fixed to the object.
  void Refine(bool pushed_out, HandEvaluation& evaluation, GraspAttempt& closed) const {
    if (!pushed_out) {
      RefineGrasp(own_.anatomy, evaluation, own_.distance, {}, closed.angles,
                  closed.wrist_from_object);
      return;
    }
    RefineGrasp(own_.anatomy, evaluation, *obstacles_, {}, closed.angles, closed.wrist_from_object);
    const FindIntrusions find = [&](const Eigen::Matrix3Xd& vertices, const Isometry3d& pose) {
      std::vector<Intrusion> found;
      AddIntrusions(vertices, pose, own_.scene.surface, own_.scene.surface_patches, 0.0, found);
      AddIntrusions(vertices, pose, giving_.vertices, giving_patches_,
                    0.5 * options_.max_hand_overlap_m, found);
      return found;
    };
    RefineGrasp(own_.anatomy, evaluation, own_.distance, {}, closed.angles,
                closed.wrist_from_object, find);
  }

  std::string_view WhyNot(const GraspTransfer& result) const {
    if (result.hand_overlap_mm > 1000.0 * options_.max_hand_overlap_m) {
      return "the hands penetrate each other";
    }
    if (result.grasp.metrics.max_penetration_mm > 1000.0 * options_.max_penetration_m) {
      return "the hand penetrates the object";
    }
    if (result.grasp.outside_place > GraspPlace::kMaxOutside) {
      return "it touches the object outside the allowed region";
    }
    return WhyRefused(own_.scene, result.grasp).empty() ? "" : "it is not an acceptable grasp";
  }

  // Refines and measures exactly.
  GraspTransfer Attempt(std::string_view method, GraspAttempt closed, bool pushed_out) const {
    HandEvaluation evaluation = AtWrist(own_.receiver);
    Refine(pushed_out, evaluation, closed);
    GraspTransfer result;
    result.method = method;
    result.grasp = Assess(own_.scene, evaluation, closed, true);
    const Eigen::Matrix3Xd vertices = InObject(result.grasp, evaluation);
    result.hand_overlap_mm = 1000.0 * Overlap(vertices);
    result.grasp.metrics.max_penetration_mm = 1000.0 * DepthInObject(vertices);
    std::tie(result.correction_m, result.correction_rad) =
        CorrectionOf(result.grasp.wrist_from_object, receiver_from_object_);
    result.refused = WhyNot(result);
    result.found = result.refused.empty();
    return result;
  }

  // Tries again if the giving hand or the object's walls would be in the receiving hand.
  GraspTransfer BestAttempt(std::string_view method, const GraspAttempt& closed) const {
    const GraspTransfer free = Attempt(method, closed, false);
    const double overlap = Excess(free);
    if (overlap <= 0.0) return free;
    const GraspTransfer clear = Attempt(method, closed, true);
    return Excess(clear) < overlap ? clear : free;
  }

  // Penetration of giving hand and object into the receiving hand above the allowed one, mm.
  double Excess(const GraspTransfer& result) const {
    return std::max(0.0, result.hand_overlap_mm - 1000.0 * options_.max_hand_overlap_m) +
           std::max(0.0, result.grasp.object_in_hand_mm - 1000.0 * options_.max_penetration_m);
  }

  // At the clip's wrist; the mirrored fingers are opened by as much as frees them.
  void TryMirroredFingers() {
    constexpr std::array<double, 3> kOpened = {0.35, 0.7, 1.0};
    std::array<std::optional<GraspTransfer>, kOpened.size()> results;
    const auto attempt = [&](int k) {
      HandEvaluation evaluation = AtWrist(own_.receiver);
      const WholeGrasp candidate{
          "mirrored", receiver_from_object_,
          own_.anatomy.axes.Clamp(mirrored_ + kOpened[k] * (own_.open - mirrored_))};
      const GraspAttempt closed = Closed(candidate, evaluation);
      // Too far off after closing, refinement cannot repair it.
      if (k > 0 && !Touches(closed, evaluation)) return;
      results[k] = BestAttempt(candidate.method, closed);
    };
    attempt(0);
    for (int k = 0; k < static_cast<int>(kOpened.size()); ++k) {
      // The first is usually good; if not, the others are tried in parallel.
      if (k == 1) {
        ParallelFor(static_cast<int>(kOpened.size()) - 1, options_.threads,
                    [&](int i) { attempt(i + 1); });
      }
      if (!results[k]) continue;
      const bool near =
          Correction(results[k]->grasp.wrist_from_object) < options_.small_correction_m;
      if (near || results[k]->found || !any_) Keep(*results[k]);
      if (near && best_.found) return;
    }
  }

  // Whether part of the hand is at the object and none deep inside.
  bool Touches(const GraspAttempt& closed, HandEvaluation& evaluation) const {
    constexpr double kNear = 0.006, kDeep = 0.008;  // meters
    const FingerPose fingers = own_.anatomy.axes.PoseOf(closed.angles);
    const Eigen::Matrix3Xd vertices =
        closed.wrist_from_object.inverse() * evaluation.At(fingers.data(), false).Vertices();
    double nearest = kNear;
    for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
      nearest = std::min(nearest, own_.distance.Distance(vertices.col(i)));
    }
    return nearest < kNear && nearest > -kDeep;
  }

  // Adds the open hand at the clip's wrist, slightly rotated, with the object moved in front of the
  // palm and then towards it until something touches.
  void AddNearWrist(std::vector<WholeGrasp>& candidates) const {
    std::vector<Vector3d> turns = {Vector3d::Zero()};
    for (const double angle : {12.0 * kDegree, 25.0 * kDegree}) {
      for (int k = 0; k < 27; ++k) {
        const Vector3d axis(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if (k != 13) turns.emplace_back(angle * axis.normalized());
      }
    }
    constexpr std::array<double, 3> kShifts = {0.0, 0.5, 1.0};
    const int count = static_cast<int>(turns.size() * kShifts.size());
    std::vector<std::vector<WholeGrasp>> found(count);
    ParallelFor(count, options_.threads, [&](int i) {
      AddPutToPalm(turns[i / kShifts.size()], kShifts[i % kShifts.size()], found[i]);
    });
    for (const auto& some : found) candidates.insert(candidates.end(), some.begin(), some.end());
  }

  // `sideways`: fraction of the shift that brings the object's center in front of the palm's.
  void AddPutToPalm(const Vector3d& turn, double sideways, std::vector<WholeGrasp>& found) const {
    const Vector3d normal = own_.anatomy.axes.PalmNormal();
    const Vector3d palm = own_.anatomy.landmarks.PalmCenter();
    Isometry3d wrist_from_object = receiver_from_object_;
    // About the object's center, which stays where it is in the clip.
    const Vector3d middle = receiver_from_object_ * own_.scene.held_at;
    wrist_from_object.linear() = ExpSO3(turn) * receiver_from_object_.linear();
    const Vector3d away = middle - palm;
    const Vector3d beside = away - away.dot(normal) * normal;
    const Vector3d at = middle - sideways * beside;
    const double reach = 0.6 * own_.scene.size + 0.12;
    double height = reach;
    double clearance = 0.0;
    const auto put = [&] {
      wrist_from_object.translation() = at + (height - (at - palm).dot(normal)) * normal -
                                        wrist_from_object.linear() * own_.scene.held_at;
    };
    const Eigen::Matrix3Xd& skin = own_.open_skin.front();
    for (int step = 0; step < 40; ++step) {
      put();
      const Isometry3d object_from_wrist = wrist_from_object.inverse();
      clearance = std::numeric_limits<double>::infinity();
      for (const int i : own_.palm_side) {
        clearance = std::min(clearance, own_.distance.Distance(object_from_wrist * skin.col(i)));
        if (clearance < 0.0) break;
      }
      if (clearance < 0.0008 || height < -0.02) break;
      height -= std::max(clearance - 0.0004, 0.0002);
    }
    if (height < -0.02 || clearance > 0.0008) return;  // the object is beside the hand
    const Isometry3d object_from_wrist = wrist_from_object.inverse();
    for (std::size_t h = 0; h < own_.open_hands.size(); ++h) {
      double least = std::numeric_limits<double>::infinity();
      for (Eigen::Index i = 0; i < own_.open_skin[h].cols() && least > -0.002; ++i) {
        least =
            std::min(least, own_.distance.Distance(object_from_wrist * own_.open_skin[h].col(i)));
      }
      if (least <= -0.002) continue;
      found.push_back(
          {"placed", wrist_from_object, own_.open_hands[h], -1, Correction(wrist_from_object)});
      return;
    }
  }

  // All candidates, nearest first.
  std::vector<WholeGrasp> WholeGrasps() const {
    std::vector<WholeGrasp> candidates;
    AddNearWrist(candidates);
    for (const Vector3d& normal : own_.planes) {
      const Isometry3d reflected = Reflected(giver_from_object_, normal, own_.scene.centroid);
      candidates.push_back({"reflected", reflected,
                            own_.anatomy.axes.Clamp(mirrored_ + 0.35 * (own_.open - mirrored_)), -1,
                            Correction(reflected)});
    }
    for (const WholeGrasp& placed : own_.placed) {
      candidates.push_back(placed);
      candidates.back().correction = Correction(placed.wrist_from_object);
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.correction < b.correction; });
    return candidates;
  }

  // The nearest candidates whose open hand leaves the giving hand room.
  std::vector<WholeGrasp> NearAndFree(const std::vector<WholeGrasp>& candidates) const {
    std::vector<WholeGrasp> near;
    for (const WholeGrasp& candidate : candidates) {
      if (static_cast<int>(near.size()) == kMaxRounds * options_.closings) break;
      const Eigen::Matrix4Xd balls =
          candidate.balls >= 0 ? own_.balls[candidate.balls]
                               : HandBalls(own_.anatomy, own_.anatomy.axes.PoseOf(candidate.start));
      if (BallOverlap(MovedBalls(candidate.wrist_from_object.inverse(), balls), giving_balls_) >
          kBallsFree) {
        continue;
      }
      const bool is_new = std::none_of(near.begin(), near.end(), [&](const WholeGrasp& other) {
        const Isometry3d apart = other.wrist_from_object.inverse() * candidate.wrist_from_object;
        return apart.translation().norm() + options_.lever_m * LogSO3(apart.linear()).norm() <
               kNeighbor;
      });
      if (is_new) near.push_back(candidate);
    }
    return near;
  }

  // Tries farther candidates only if no nearer one is good. Refines the best of those that closed
  // well.
  void TryWholeGrasps() {
    const std::vector<WholeGrasp> near = NearAndFree(WholeGrasps());
    for (int round = 0; round < kMaxRounds && !best_.found; ++round) {
      const int begin = round * options_.closings;
      const int count = std::min(options_.closings, static_cast<int>(near.size()) - begin);
      if (count <= 0) break;
      std::vector<GraspAttempt> closed(count);
      ParallelFor(count, options_.threads, [&](int i) {
        HandEvaluation evaluation = AtWrist(own_.receiver);
        closed[i] = Closed(near[begin + i], evaluation);
        closed[i].rank = Assess(own_.scene, evaluation, closed[i], false).score -
                         options_.correction_weight * near[begin + i].correction;
      });
      std::vector<int> order(count);
      std::iota(order.begin(), order.end(), 0);
      std::ranges::stable_sort(order, std::greater{}, [&](int i) { return closed[i].rank; });
      order.resize(std::min(count, options_.refinements));
      std::vector<GraspTransfer> results(order.size());
      ParallelFor(static_cast<int>(order.size()), options_.threads, [&](int i) {
        results[i] = BestAttempt(near[begin + order[i]].method, closed[order[i]]);
      });
      for (const GraspTransfer& result : results) Keep(result);
    }
  }

  const TransferScene& own_;
  const GraspTransferOptions& options_;
  const Isometry3d& giver_from_object_;
  const Isometry3d& receiver_from_object_;
  TriangleMesh giving_;
  std::optional<SignedDistance> giving_surface_;
  PointPatches giving_patches_;
  Eigen::Matrix4Xd giving_balls_;  // object frame
  std::optional<DistanceGrid> obstacles_;
  HandAngles mirrored_;
  GraspTransfer best_;
  bool any_ = false;
};

}  // namespace

FingerPose MirrorFingers(const FingerPose& fingers) {
  FingerPose mirrored = fingers;
  for (int k = 0; k < kJointsPerHand; ++k) mirrored.segment<2>(3 * k + 1) *= -1.0;
  return mirrored;
}

GraspReceiver::GraspReceiver(const HandModel& receiver, const TriangleMesh& object,
                             const SignedDistance& surface, const DistanceGrid& distance,
                             const GraspTransferOptions& options)
    : scene_(std::make_unique<const TransferScene>(receiver, object, surface, distance, options)) {}

GraspReceiver::~GraspReceiver() = default;

GraspTransfer GraspReceiver::TakeOver(const HandModel& giver, const FingerPose& giver_fingers,
                                      const Isometry3d& giver_from_object,
                                      const Isometry3d& receiver_from_object) const {
  if (giver.HandSide() == scene_->receiver.HandSide()) {
    throw Error("grasp transfer", "both hands are of the same side",
                "Give a right and a left hand");
  }
  return TransferSearch(*scene_, giver, giver_fingers, giver_from_object, receiver_from_object)
      .Run();
}

double GraspReceiver::LeastCorrection(const HandAnatomy& giver, const FingerPose& giver_fingers,
                                      const Isometry3d& giver_from_object,
                                      const Isometry3d& receiver_from_object) const {
  const Eigen::Matrix4Xd giving =
      MovedBalls(giver_from_object.inverse(), HandBalls(giver, giver_fingers));
  const Vector3d given = receiver_from_object.inverse().translation();
  double least = 0.5;
  for (const TransferScene::WholeGrasp& placed : scene_->placed) {
    // The translation alone is usually too far.
    if ((placed.wrist_from_object.inverse().translation() - given).norm() >= least) continue;
    const double correction = scene_->Correction(placed.wrist_from_object, receiver_from_object);
    if (correction >= least) continue;
    const Eigen::Matrix4Xd balls =
        MovedBalls(placed.wrist_from_object.inverse(), scene_->balls[placed.balls]);
    if (BallOverlap(balls, giving) <= kBallsFree) least = correction;
  }
  return least;
}

GraspTransfer TransferGrasp(const HandModel& giver, const FingerPose& giver_fingers,
                            const Isometry3d& giver_from_object, const HandModel& receiver,
                            const Isometry3d& receiver_from_object, const TriangleMesh& object,
                            const SignedDistance& surface, const DistanceGrid& distance,
                            const GraspTransferOptions& options) {
  return GraspReceiver(receiver, object, surface, distance, options)
      .TakeOver(giver, giver_fingers, giver_from_object, receiver_from_object);
}

}  // namespace holdfast
