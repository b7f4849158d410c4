// SPDX-License-Identifier: MIT
#include "solver/synthesis/holding_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "generator/actions/face_marks.h"
#include "generator/actions/standing_start.h"
#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/matching/capture_quality.h"
#include "generator/matching/foot_lock.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"
#include "solver/actions/action_motion.h"
#include "solver/carry/standing_grasp.h"
#include "solver/grasp/object_shape.h"
#include "solver/synthesis/motion_passes.h"
#include "solver/synthesis/synthesis.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/change_spline.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr int kTries = 6;  // per start, in different styles
constexpr double kMaxHandError = 5.0 * kDegree;
constexpr std::uint64_t kStyles = 0x57A7;  // random stream
constexpr int kGrips = 2;                  // for a striking tool: only the best grasps are firm

std::unique_ptr<const ActionProp> PropOf(const LoadedObject& object, bool mirrored, int threads) {
  return std::make_unique<const ActionProp>(MakeActionProp(
      object.name, object.mesh, ForFitting(object, kPairVertices, nullptr), mirrored, threads));
}

std::optional<Vector3d> OpeningOf(const ActionProp& prop) {
  const ObjectOpening opening = FindOpening(ObjectShape(prop.mesh, *prop.fit.distance));
  return opening.Any() ? std::optional(opening.up) : std::nullopt;
}

// Removes grasps that cover the part that is bitten, if there are others. Right-hand grasps.
void LeaveFreeWhatIsBitten(const ObjectMarks& marks, std::vector<Grasp>& grasps) {
  constexpr double kCovers_m = 0.07;
  const Eigen::Vector3d middle(-0.09, -0.03, 0.0);  // of the closed hand, in the wrist's frame
  const auto covers = [&](const Grasp& grasp) {
    return (grasp.wrist_from_object * marks.tip - middle).norm() < kCovers_m;
  };
  if (!std::ranges::all_of(grasps, covers)) std::erase_if(grasps, covers);
}

// Stands otherwise, by the seed: feet apart and turned, weight on one leg, trunk, head and left
// arm. The right hand and the object stay. Angles in radians, of a standing person.
struct StandingStyle {
  std::array<Vector3d, 2> foot;   // left, right: outward, forward, meters; outward turn
  Eigen::Vector2d weight;         // of the pelvis, to the left and forward, meters
  Vector3d trunk, head;           // lean forward, turn left, bend right
  double looks_up = 0.0;          // fraction of the way from the object to straight ahead
  double arm = 0.0, elbow = 0.0;  // left: forward; flexed
};

StandingStyle DrawStandingStyle(std::uint64_t seed, bool table) {
  RandomDraws draws(seed);
  const auto degrees = [&](double low, double high) { return kDegree * draws.Uniform(low, high); };
  StandingStyle style;
  for (Vector3d& foot : style.foot) {
    foot = {draws.Uniform(-0.02, 0.06), draws.Uniform(-0.06, 0.06), degrees(-4.0, 16.0)};
  }
  style.weight = {draws.Uniform(-0.04, 0.04), draws.Uniform(-0.02, 0.02)};
  style.trunk = {degrees(-2.0, 8.0), degrees(-9.0, 9.0), degrees(-4.0, 4.0)};
  style.head = {0.0, degrees(-10.0, 10.0), degrees(-4.0, 4.0)};
  style.looks_up = draws.Uniform(0.1, 0.9);
  style.arm = degrees(-6.0, table ? 2.0 : 14.0);
  style.elbow = degrees(0.0, table ? 10.0 : 40.0);
  return style;
}

// Applies `share` of a style to the one frame of a start; returns by how much the right hand misses
// its place, meters.
double ApplyStandingStyle(const StandingStyle& style, double share,
                          const Eigen::Matrix3Xd& rest_joints, Clip& start) {
  std::vector<BodyFrame> frames = BodyFrames(start, rest_joints);
  BodyFrame& frame = frames[0];
  const BodyPlacement placed = Place(rest_joints, frame);
  const Isometry3d wrist = placed.WorldFromJoint(kRightWrist);
  const auto turned = [&](const Vector3d& by) { return Eigen::Quaterniond(ExpSO3(share * by)); };
  FeetTarget feet = FeetOf(placed);
  const Eigen::Matrix3d heading =
      Eigen::AngleAxisd(Yaw(frame), Vector3d::UnitZ()).toRotationMatrix();
  for (int f = 0; f < 2; ++f) {
    const double out = f == 0 ? 1.0 : -1.0;  // leftwards
    const Vector3d& by = style.foot[f];
    feet.ankle[f] += share * (heading * Vector3d(out * by.x(), -by.y(), 0.0));
    feet.rotation[f] =
        Eigen::AngleAxisd(share * out * by.z(), Vector3d::UnitZ()) * feet.rotation[f];
  }
  ShiftWeight(style.weight, share, frame);
  for (const int joint : {kSpine1, kSpine2, kSpine3}) {
    frame.local[joint] = turned(style.trunk / 3.0) * frame.local[joint];
  }
  for (const int joint : {kNeck, kHead}) {
    Eigen::Quaterniond& local = frame.local[joint];
    local = turned(0.5 * style.head) *
            local.slerp(share * style.looks_up, Eigen::Quaterniond::Identity());
  }
  const Limb arm = Arm(Side::kLeft);
  // Off the hip that comes out to it.
  const double out = kDegree * (4.0 + 150.0 * std::max(0.0, style.weight.x()));
  frame.local[arm.root] = turned({-style.arm, 0.0, out}) * frame.local[arm.root];
  frame.local[arm.middle] = frame.local[arm.middle] *
                            Eigen::Quaterniond(Eigen::AngleAxisd(share * style.elbow, arm.hinge));
  frame.pelvis.z() -= PelvisSink(rest_joints, frames, {feet})[0];
  PlaceLegs(rest_joints, feet, frame);
  SetBodyFrames(frames, rest_joints, start);
  return MoveWrist(rest_joints, Side::kRight, wrist.linear(), wrist.translation(),
                   start.trans.col(0), start.pose[0]);
}

void VaryStart(const Eigen::Matrix3Xd& rest_joints, std::uint64_t seed, Clip& start) {
  constexpr double kMisses_m = 0.001;
  const StandingStyle style = DrawStandingStyle(seed, start.table.has_value());
  for (const double share : {1.0, 0.6, 0.3}) {
    Clip varied = start;
    if (ApplyStandingStyle(style, share, rest_joints, varied) > kMisses_m) continue;
    start = std::move(varied);
    return;
  }
}

}  // namespace

HoldingStart StartInClip(const Clip& clip, const ClipBody& body, const LoadedObject& object,
                         std::optional<int> frame, int threads, const std::string& source) {
  if (body.model->LoneHand()) {
    throw Error(source, "contains only a hand", "Give a clip of a whole body");
  }
  RequireMeters(source, clip, *body.model);
  const int frames = clip.NumFrames();
  if (frame && *frame >= frames) {
    throw Error(source, fmt::format("has frames 0 to {}, but no frame {}", frames - 1, *frame),
                "Give a frame in that range");
  }
  HoldingStart start;
  start.clip = Slice(clip, 0, frame.value_or(frames - 1) + 1);
  const char* fix =
      "Give a clip and frame with the object in a hand, as 'holdfast fit' and 'holdfast grasp' "
      "write them, or give none to generate a start";
  if (!start.clip.object) throw Error(source, "has no object track", fix);
  if (start.clip.holding_hand.empty() || start.clip.holding_hand.back() == 0) {
    throw Error(source, "nobody holds the object in that frame", fix);
  }
  start.mirrored = start.clip.holding_hand.back() == kHoldsLeft;
  start.actor = std::make_unique<const ActionActor>(body.model, body.betas);
  if (start.mirrored) {
    start.clip = MirrorClip(start.clip, start.actor->Measures().rest_joints.col(0));
  }
  start.prop = PropOf(object, start.mirrored, threads);
  start.opening = OpeningOf(*start.prop);
  if (start.clip.holding_hand.back() == (kHoldsRight | kHoldsLeft)) {
    start.both = Slice(start.clip, start.clip.NumFrames() - 1, start.clip.NumFrames());
    start.clip.holding_hand.assign(start.clip.pose.size(), kHoldsRight);
  }
  return start;
}

namespace {

StandingHold MakeHoldInBothHands(const ClipBody& body, const LoadedObject& object,
                                 std::string_view action, StandingHoldOptions options) {
  if (options.in_hand == false) {
    throw Error("start", "both hands begin with the object between them, not on a table",
                "Leave it out, or give one hand");
  }
  options.hands = GraspHands::kRight;
  options.in_hand = true;
  StandingHold hold = MakeStandingHold(body, object, action, options);
  if (!hold.graspable) {  // too wide for one hand: the motion is that of a smaller object
    constexpr double kGraspable_m = 0.07;
    Eigen::Vector3d extent = Extent(object.mesh);
    std::sort(extent.begin(), extent.end());
    LoadedObject smaller = object;
    smaller.mesh.vertices *= kGraspable_m / extent(1);
    hold = MakeStandingHold(body, smaller, action, options);
    hold.start.prop = PropOf(object, false, options.threads);
    hold.start.opening = OpeningOf(*hold.start.prop);
  }
  if (!hold.fault.empty()) return hold;
  BothHandsOptions search;
  search.seed = options.seed;
  search.threads = options.threads;
  hold.start.both = StandWithForearmsForward(body);
  HoldStanding(body, object, std::nullopt, search, *hold.start.both);
  return hold;
}

}  // namespace

StandingHold MakeStandingHold(const ClipBody& body, const LoadedObject& object,
                              std::string_view action, const StandingHoldOptions& options) {
  if (body.model->LoneHand()) {
    throw Error(body.model->Name(), "contains only a hand: actions need a whole body",
                "Give a whole-body model");
  }
  if (options.hands == GraspHands::kBoth) return MakeHoldInBothHands(body, object, action, options);
  StandingHold hold;
  HoldingStart& start = hold.start;
  start.mirrored = options.hands == GraspHands::kLeft;
  start.actor = std::make_unique<const ActionActor>(body.model, body.betas);
  start.prop = PropOf(object, start.mirrored, options.threads);
  start.opening = OpeningOf(*start.prop);
  const ActionProp& prop = *start.prop;
  const HandModel &right = start.actor->Hand(Side::kRight), &left = start.actor->Hand(Side::kLeft);
  std::vector<Grasp> grasps =
      FindActionGrasps(right, prop, options.seed, kGraspChoice, &hold.grasp, options.threads);
  hold.graspable = !grasps.empty();
  hold.fault = "no grasp";
  if (!hold.graspable) return hold;
  AddTurnedOver(prop.marks, grasps);
  if (action == "eat" && prop.marks.size.x() > 2.0 * prop.marks.size.y()) {
    LeaveFreeWhatIsBitten(prop.marks, grasps);
  }
  std::vector<std::pair<Grasp, Grasp>> pairs;
  if (action == "offhand") {
    pairs = FindGraspPairs(right, left, prop, grasps, options.seed, kPairTries);
  }
  const auto begin = [&](const ActionGrasps& choices, std::optional<bool> in_hand) {
    ActionClip best;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const std::uint64_t seed = MixSeed(options.seed, static_cast<std::uint64_t>(attempt));
      const StandingStart standing = OwnStanding(start.actor->Measures(), seed);
      ActionClip made =
          MakeActionStart({action, *start.actor, prop, choices, standing, false, seed}, in_hand);
      // The object is upright as far as the wrist can turn.
      const bool better = made.fault.empty() != best.fault.empty()
                              ? made.fault.empty()
                              : made.quality.hand_error_rad < best.quality.hand_error_rad;
      if (attempt == 0 || better) best = std::move(made);
      if (best.fault.empty() && best.quality.hand_error_rad < kMaxHandError) break;
    }
    return best;
  };
  ActionClip made;
  made.fault = "no grasp";
  // Striking requires the handle in the palm, which is not how it is taken from a table.
  if (action == "use" && options.in_hand.value_or(true)) {
    std::vector<Grasp> grips = FindToolGrips(right, prop, options.seed, kGrips, options.threads);
    AddTurnedOver(prop.marks, grips);
    if (!grips.empty()) made = begin(ActionGrasps(*start.actor, grips, {}), true);
  }
  if (!made.fault.empty()) {
    made = begin(ActionGrasps(*start.actor, grasps, pairs), options.in_hand);
  }
  hold.fault = made.fault;
  hold.detail = made.detail;
  start.clip = std::move(made.clip);
  if (hold.fault.empty()) {
    std::uint64_t seed = MixSeed(options.seed, kStyles);
    for (const char letter : action) seed = MixSeed(seed, static_cast<std::uint64_t>(letter));
    VaryStart(start.actor->Measures().rest_joints, seed, start.clip);
  }
  return hold;
}

namespace {

constexpr double kReaches_m = 0.15;  // beyond this, the action does not reach the face
constexpr double kThere_m = 0.05,
                 kAway_m = 0.13;  // beyond the minimum distance: full and zero correction
constexpr double kPlace_m = 0.002, kPath_m = 0.03;
constexpr double kKnot_s = 1.0 / 6.0;
constexpr int kPasses = 3, kIterations = 12;

// Offset of the object from its place at the face in every frame, in the head's frame.
using FaceCourse = std::vector<Vector3d>;

FaceDistance NearestOf(const FaceCourse& course) {
  const auto nearest =
      std::ranges::min_element(course, {}, [](const Vector3d& lack) { return lack.norm(); });
  return {static_cast<int>(nearest - course.begin()), nearest->norm()};
}

class FaceRefit {
 public:
  FaceRefit(const ActionActor& actor, const ActionProp& prop, std::string_view action,
            const Clip& clip)
      : rest_joints_(actor.Measures().rest_joints),
        face_(actor.Face()),
        marks_(prop.marks),
        action_(action),
        chain_(rest_joints_, Side::kRight),
        rate_(clip.frame_rate),
        frames_(BodyFrames(clip, rest_joints_)),
        feet_(FeetOf(Place(rest_joints_, frames_))) {
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      wrist_from_object_.push_back(Wrist(t).inverse() *
                                   clip.object->Pose(static_cast<Eigen::Index>(t)));
    }
  }

  // Returns nothing if the action has no place at the face.
  std::optional<FaceCourse> Course() const {
    FaceCourse course;
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      const BodyPlacement placed = Place(rest_joints_, frames_[t]);
      const Isometry3d head_from_object = placed.WorldFromJoint(kHead).inverse() *
                                          placed.WorldFromJoint(chain_.WristJointId()) *
                                          wrist_from_object_[t];
      const auto wanted = FacePlaceOf(action_, marks_, face_, head_from_object);
      if (!wanted) return std::nullopt;
      course.push_back(wanted->place - head_from_object * wanted->mark);
    }
    return course;
  }

  // Weight of the correction per frame: full near the face, zero on the way there.
  std::vector<double> Shares(const FaceCourse& course) const {
    const double least = NearestOf(course).distance_m;
    std::vector<double> raw(frames_.size());
    for (std::size_t t = 0; t < raw.size(); ++t) {
      const double away = (course[t].norm() - least - kThere_m) / (kAway_m - kThere_m);
      const double x = std::clamp(1.0 - away, 0.0, 1.0);
      raw[t] = x * x * (3.0 - 2.0 * x);
    }
    return raw;
  }

  void Solve(const FaceCourse& course, const std::vector<double>& shares) {
    ChangeSpline change(static_cast<int>(frames_.size()),
                        std::max(2, static_cast<int>(std::lround(kKnot_s * rate_))));
    ceres::Problem problem;
    change.AddTo(problem);
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      const ActionFrameTerms terms = TermsOf(t, course[t], shares[t]);
      change.AddFrame(problem, static_cast<int>(t), [&](const Eigen::Vector4d& basis) {
        return new ActionFrameBlock(chain_, frames_[t], terms, basis);
      });
    }
    change.AddPrior(problem, UpperBodySigma({0.02, 0.03, 0.01}, 4.0 * kDegree, 6.0 * kDegree),
                    0.35);
    change.HoldStart(problem);
    if (!SolveQuietly(SparseOptions(kIterations, 1e-3), problem).IsSolutionUsable()) return;
    std::vector<BodyFrame> changed;
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      changed.push_back(chain_.Changed(frames_[t], change.At(static_cast<int>(t))));
      PlaceLegs(rest_joints_, feet_[t], changed.back());
    }
    frames_ = std::move(changed);
  }

  void WriteTo(Clip& clip) const {
    SetBodyFrames(frames_, rest_joints_, clip);
    for (std::size_t t = 0; t < frames_.size(); ++t) {
      clip.object->SetPose(static_cast<Eigen::Index>(t), Wrist(t) * wrist_from_object_[t]);
    }
  }

 private:
  Isometry3d Wrist(std::size_t t) const {
    return Place(rest_joints_, frames_[t]).WorldFromJoint(chain_.WristJointId());
  }

  ActionFrameTerms TermsOf(std::size_t t, const Vector3d& lack, double share) const {
    const BodyFrame& frame = frames_[t];
    const BodyPlacement placed = Place(rest_joints_, frame);
    const Vector3d wrist = placed.joints.col(chain_.WristJointId());
    ActionFrameTerms terms;
    terms.hand.share = share;
    terms.hand.in_world = wrist;
    terms.hand.in_head = placed.WorldFromJoint(kHead).inverse() * wrist + lack;
    terms.hand.sigma_m = std::min(kPath_m, kPlace_m / std::max(share, 1e-3));
    terms.gaze.wanted = placed.rotation[kHead].col(2);
    terms.lean.up = placed.rotation[kSpine3].col(1);
    terms.lean.forward = placed.rotation[kSpine3].col(2);
    terms.balance.captured = Balance::Middle(chain_, placed);
    terms.legs = LegReach::Of(chain_, placed, feet_[t]);
    terms.range = JointRange::Of(chain_, frame, limits_);
    return terms;
  }

  const Eigen::Matrix3Xd& rest_joints_;
  const FaceMarks& face_;
  const ObjectMarks& marks_;
  std::string_view action_;
  UpperBodyChain chain_;
  JointLimits limits_ = CapturedJointLimits();
  double rate_;
  std::vector<BodyFrame> frames_;
  std::vector<FeetTarget> feet_;
  std::vector<Isometry3d> wrist_from_object_;
};

std::optional<FaceDistance> DistanceOf(const std::optional<FaceCourse>& course) {
  if (!course || course->empty()) return std::nullopt;
  return NearestOf(*course);
}

}  // namespace

std::optional<FaceDistance> NearestToFace(const ActionActor& actor, const ActionProp& prop,
                                          std::string_view action, const Clip& clip) {
  return DistanceOf(FaceRefit(actor, prop, action, clip).Course());
}

std::optional<FaceDistance> RefitAtFace(const ActionActor& actor, const ActionProp& prop,
                                        std::string_view action, Clip& clip) {
  FaceRefit refit(actor, prop, action, clip);
  std::optional<FaceCourse> course = refit.Course();
  const std::optional<FaceDistance> before = DistanceOf(course);
  if (!before || before->distance_m > kReaches_m) return before;
  const std::vector<double> shares = refit.Shares(*course);
  for (int pass = 0; pass < kPasses; ++pass) {
    refit.Solve(*course, shares);
    course = refit.Course();
  }
  refit.WriteTo(clip);
  return DistanceOf(course);
}

}  // namespace holdfast
