// SPDX-License-Identifier: MIT
#include "solver/carry/drink.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/carry/cup_in_hand.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/object_shape.h"
#include "solver/take/take_table.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kNearest_m = 0.25, kMinRise_m = 0.1;
constexpr double kOverEyes_m = 0.08, kFallsBehind_m = 0.04,
                 kBehindEyes_m = 0.08;  // of a palm that combs hair
constexpr double kApproach_s = 0.4;     // in which the wrist leaves the clip for the cup
constexpr double kUpright = 0.7;        // fraction of the motion to the mouth in which it returns
constexpr double kFarTilt = 50.0 * kDegree, kMaxBack = 45.0 * kDegree;
constexpr double kMaxYaw = 30.0 * kDegree;
constexpr double kLipsFrom_m = 0.12, kLipsAt_m = 0.02;  // of the rim, beyond its minimum
constexpr double kLipsNear_m = 0.01;                    // of the rim, for the hand not to move
constexpr double kHeadComes_m = 0.02;                   // of the lips, maximum
constexpr double kHandCalm_s = 0.15;  // before and after a frame, in which its shift is averaged
constexpr double kHandGives_m = 0.025, kGive = 5.0 * kDegree;  // maximum in total; per step
constexpr int kGives = 4;
constexpr double kAboveTable_m = 0.003;  // of the hand that takes hold
constexpr int kCupPoints = 250;
constexpr double kUpOpening = 0.9;  // minimum height of its unit direction

// From `drink` in steps of `way`: down to the table, then until the hand is slowest.
int RestBeside(const Matrix3Xd& palm, const Eigen::VectorXd& speed, int drink, int way,
               double table_height) {
  const int last = static_cast<int>(speed.size()) - 1;
  const auto inside = [&](int t) { return t > 0 && t < last; };
  int t = drink;
  while (inside(t) && palm(2, t) > table_height) t += way;
  double fastest = 0.0;
  for (int k = drink; k != t; k += way) fastest = std::max(fastest, speed(k));
  while (inside(t) && speed(t) > 0.15 * fastest) t += way;
  while (inside(t) && speed(t + way) < speed(t)) t += way;
  return t;
}

// Detects combing: the hand moves over the eyes, and there behind them or down behind the head; or
// by the side of the head to behind the eyes and down. When a cup is drained, the hand goes as high
// with the head tilted back, but stays in front of the face and returns the same way.
bool CombsHair(const PalmTracks& tracks, const Matrix3Xd& palm, const FaceMarks& face) {
  double over_eyes = -1.0, behind_eyes = -1.0, behind_face = -1.0, rearmost = 1e9, falls = 0.0;
  const double top = palm.row(2).maxCoeff();
  for (Eigen::Index t = 0; t < palm.cols(); ++t) {
    const Isometry3d& head = tracks.head[t];
    const Vector3d from_eyes = palm.col(t) - head * face.eyes;
    over_eyes = std::max(over_eyes, from_eyes.z());
    if (from_eyes.z() > kOverEyes_m) {
      behind_eyes = std::max(behind_eyes, -from_eyes.dot(tracks.forward));
    }
    if (palm(2, t) < (head * face.mouth).z()) continue;
    behind_face = std::max(behind_face, -from_eyes.dot(head.linear().col(2)));
    const double ahead = palm.col(t).dot(tracks.forward);
    if (ahead > rearmost) continue;
    rearmost = ahead;
    falls = top - palm(2, t);
  }
  const bool goes_down = falls > kFallsBehind_m;
  return (over_eyes > kOverEyes_m && (goes_down || behind_eyes > kBehindEyes_m)) ||
         (goes_down && behind_face > kBehindEyes_m);
}

// Drinking point of a cup in a pose: the lowest point of its rim, or, if upright, the one nearest
// to `mouth`; world, meters.
Vector3d DrinkingEdge(const ObjectMarks& cup, const Isometry3d& world_from_cup,
                      const Vector3d& mouth) {
  constexpr double kTowardsMouth = 0.15;  // relative to the sine of the tilt
  const Vector3d axis = world_from_cup.linear().col(2), middle = world_from_cup * cup.rim;
  const auto in_plane = [&](const Vector3d& v) { return Vector3d(v - v.dot(axis) * axis); };
  const Vector3d way =
      kTowardsMouth * in_plane(mouth - middle).normalized() - in_plane(Vector3d::UnitZ());
  return middle + cup.rim_radius * way.normalized();
}

}  // namespace

namespace {

bool IsOpenOnTop(const PreparedObject& cup) {
  const ObjectOpening opening = FindOpening(ObjectShape(cup.object.mesh, *cup.fit.distance));
  return opening.Any() && opening.up.z() > kUpOpening;
}

// Scans of bottles and cans have no hole, but are round on top.
bool IsRoundOnTop(const PreparedObject& cup, const ObjectMarks& marks) {
  constexpr double kLeast_m = 0.005, kRound = 1.15, kBand_m = 0.003;
  if (marks.rim_radius < kLeast_m) return false;
  double farthest = 0.0;
  for (const auto& p : cup.object.mesh.vertices.colwise()) {
    if (p.z() < marks.rim.z() - kBand_m) continue;
    farthest = std::max(farthest, (p - marks.rim).head<2>().norm());
  }
  return farthest < kRound * marks.rim_radius;
}

// Open on top and not as flat as a bowl or a pan; or a closed bottle: taller than a light bulb,
// with a neck that is round on top.
bool IsVessel(const PreparedObject& object) {
  constexpr double kFlat = 0.6, kNeck = 0.35, kTall = 1.5;  // of the width
  constexpr double kBottle_m = 0.14;
  const ObjectMarks marks = MarksOf(object.object.name, object.object.mesh);
  if (marks.size.z() > kFlat * marks.size.head<2>().minCoeff() && IsOpenOnTop(object)) return true;
  const double width = marks.size.head<2>().maxCoeff();
  return marks.size.z() > std::max(kBottle_m, kTall * width) && marks.rim_radius < kNeck * width &&
         IsRoundOnTop(object, marks);
}

}  // namespace

std::optional<DrinkTimes> FindDrink(const PalmTracks& tracks, const FaceMarks& face) {
  DrinkTimes times;
  double nearest = 1e9;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    for (Eigen::Index t = 0; t < tracks.Of(side).cols(); ++t) {
      const Vector3d mouth = tracks.head[t] * face.mouth;
      const double away = (tracks.Of(side).col(t) - mouth).norm();
      if (away >= nearest) continue;
      nearest = away;
      times.side = side;
      times.drink = static_cast<int>(t);
    }
  }
  if (nearest > kNearest_m) return std::nullopt;
  const Matrix3Xd& palm = tracks.Of(times.side);
  const double low = palm.row(2).minCoeff(), rise = palm(2, times.drink) - low;
  if (rise < kMinRise_m || CombsHair(tracks, palm, face)) return std::nullopt;
  const Eigen::VectorXd speed = tracks.Speed(times.side);
  times.lift = RestBeside(palm, speed, times.drink, -1, low + 0.2 * rise);
  times.put_down = RestBeside(palm, speed, times.drink, 1, low + 0.2 * rise);
  return times;
}

std::optional<Side> DrinkingHand(const Clip& clip, const ClipBody& body,
                                 const PreparedObject& object) {
  if (clip.object || body.model->LoneHand()) return std::nullopt;
  if (!clip.action.empty() && clip.action != "drink") return std::nullopt;
  if (!IsVessel(object)) return std::nullopt;
  const BodySurface surface(body.model, body.betas);
  try {
    const PalmTracks tracks = TrackPalms(clip, surface.RestJoints());
    const FaceMarks face = FindFaceMarks(surface);
    const auto times = FindDrink(tracks, face);
    if (!times) return std::nullopt;
    // A clip that begins or ends at the mouth shows no table. Nor does one in which the hand stays
    // high, since the person looks at something; and beside the head the hand combs.
    constexpr double kFromTable_m = 0.3, kBeforeMouth_m = 0.03;
    const Matrix3Xd& palm = tracks.Of(times->side);
    const double low = palm.row(2).minCoeff(), high = palm(2, times->drink);
    const double ends = std::max(palm(2, times->lift), palm(2, times->put_down));
    const Vector3d from_head = tracks.head[times->drink].inverse() * palm.col(times->drink);
    if (ends > 0.5 * (low + high) || high - low < kFromTable_m ||
        from_head.z() < face.mouth.z() + kBeforeMouth_m) {
      return std::nullopt;
    }
    return times->side;
  } catch (const Error&) {  // no face
    return std::nullopt;
  }
}

DrinkMeasures MeasureDrink(const Clip& clip, const DrinkTimes& times, const Matrix3Xd& rest_joints,
                           const FaceMarks& face, const ObjectMarks& cup) {
  BodyState state;
  ForwardJoints(rest_joints, clip.pose[times.drink], clip.trans.col(times.drink), state);
  const Vector3d mouth = state.WorldFromJoint(kHead) * face.mouth;
  const auto off_upright = [&](int t) {
    return std::acos(std::clamp(clip.object->Pose(t).linear()(2, 2), -1.0, 1.0));
  };
  DrinkMeasures measures;
  measures.rim_from_mouth_m =
      (DrinkingEdge(cup, clip.object->Pose(times.drink), mouth) - mouth).norm();
  measures.tilt_rad = off_upright(times.drink);
  measures.lean_rad = std::max(off_upright(times.lift), off_upright(times.put_down));
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    const Vector3d neck = state.joints.col(kHead) - state.joints.col(kNeck);
    measures.neck_rad =
        std::max(measures.neck_rad, std::acos(std::clamp(neck.z() / neck.norm(), -1.0, 1.0)));
  }
  return measures;
}

namespace {

class DrinkServer {
 public:
  DrinkServer(const ClipBody& body, const PreparedObject& cup, std::uint64_t seed, Clip& clip)
      : body_(body),
        cup_(cup),
        seed_(seed),
        clip_(clip),
        surface_(body.model, body.betas),
        face_(FindFaceMarks(surface_)),
        marks_(MarksOf(cup.object.name, cup.object.mesh)) {}

  DrinkReport Serve() {
    if (!IsOpenOnTop(cup_) && !IsRoundOnTop(cup_, marks_)) {
      throw Error(cup_.object.name, "has no rim to drink from",
                  "Give a cup, glass, bottle or can that stands upright (its own z up)");
    }
    const auto times = FindDrink(TrackPalms(clip_, surface_.RestJoints()), face_);
    if (!times) {
      throw Error("the clip", "has no hand that goes from a table to the mouth and back",
                  "Give a clip of somebody who drinks, or fit without --drink");
    }
    report_.times = times_ = *times;
    hand_.emplace(body_.model, body_.betas, times_.side);
    state_.emplace(*hand_);
    Take();
    if (report_.status == GraspStatus::kNoRoom) return report_;
    MoveCup();
    MoveHead();
    AddTable(std::array{times_.lift, times_.put_down}, surface_, cup_.object.mesh, 1, clip_);
    return report_;
  }

 private:
  Isometry3d Wrist(int t) {
    state_->SetBody(clip_.pose[t], clip_.trans.col(t));
    return state_->WorldFromWrist();
  }

  // Grasps the cup: mean of the hand poses at `lift` and `put_down`.
  void Take() {
    const Isometry3d lift = Wrist(times_.lift), put_down = Wrist(times_.put_down);
    HandAtTable at;
    at.up = (lift.linear().row(2) + put_down.linear().row(2)).normalized();
    const double table = TableHeight();
    at.table_m = table - 0.5 * (lift.translation() + put_down.translation()).z();
    Wrist(times_.lift);
    state_->Evaluate(FingersOf(clip_.pose[times_.lift], times_.side), false);
    const auto joints = state_->JointPositions();
    const Vector3d between = 0.5 * joints.col(3 * kThumb + 2) +
                             0.25 * (joints.col(3 * kIndex + 2) + joints.col(3 * kMiddle + 2));
    at.between = lift.inverse() * between;
    // The hand is about halfway up, and leaves the rim free for the lips.
    const double height = marks_.size.z(), held = at.between.dot(at.up) - at.table_m;
    at.table_m += held - std::clamp(held, 0.25 * height, 0.42 * height);
    // The hand is above the table, with the forearm: a low cup is held by its upper half. But the
    // thighs of a seated person are under the table.
    const double lowest = (at.up.transpose() * (lift.inverse() * state_->Vertices())).minCoeff();
    const double legs = SkinBelow(times_.lift, between) - lift.translation().z();
    at.table_m = std::min(at.table_m, std::max(lowest, legs) - kAboveTable_m);
    at.also = Drinkable();
    report_.grasp = HoldStanding(*hand_, at, cup_, marks_, seed_, report_.status);
    table_ = 0.5 * (lift.translation() + put_down.translation()).z() + at.table_m;
  }

  // Height of the highest skin, without hands and forearms, below a cup at `place`.
  double SkinBelow(int t, const Vector3d& place) const {
    constexpr double kAround_m = 0.04;
    double top = 0.0;
    const Matrix3Xd skin = SkinNearTable(clip_, surface_, place, 1, {t}, false);
    for (const auto& point : skin.colwise()) {
      const Vector3d from = point - place;
      if (from.z() < 0.0 && from.head<2>().norm() < marks_.rim_radius + kAround_m) {
        top = std::max(top, point.z());
      }
    }
    return top;
  }

  // Prefers object poses in the hand with the rim near the mouth and no finger at the lips.
  std::function<double(const Isometry3d&, const Matrix3Xd&)> Drinkable() {
    constexpr double kLostByMeter = 12.0, kRoom_m = 0.03, kLostByHand = 20.0;  // per meter
    const Isometry3d drinks = Wrist(times_.drink);
    const Vector3d lips = Head(times_.drink) * LipsOf(face_);
    return [this, drinks, lips](const Isometry3d& wrist_from_cup, const Matrix3Xd& skin) {
      const Vector3d edge = DrinkingEdge(marks_, drinks * wrist_from_cup, lips);
      const Vector3d at = drinks.inverse() * edge;
      const double hand = std::sqrt((skin.colwise() - at).colwise().squaredNorm().minCoeff());
      return -kLostByMeter * (edge - lips).norm() - kLostByHand * std::max(0.0, kRoom_m - hand);
    };
  }

  // Height of the hand's support before the grasp.
  double TableHeight() {
    double lowest = 1e9;
    for (int t = 0; t < times_.lift; t += std::max(1, times_.lift / 40)) {
      Wrist(t);
      state_->Evaluate(FingersOf(clip_.pose[t], times_.side), false);
      lowest = std::min(lowest, state_->Vertices().row(2).minCoeff());
    }
    return lowest < 1e9 ? lowest : Wrist(0).translation().z();
  }

  // The standing pose of the cup on the table nearest to `held`.
  Isometry3d Standing(const Isometry3d& held) const {
    const Matrix3d level =
        RotationBetween(held.linear().col(2), Vector3d::UnitZ()).toRotationMatrix() * held.linear();
    Vector3d at = held * marks_.middle - level * marks_.middle;
    at.z() = table_ - cup_.object.mesh.vertices.row(2).minCoeff();
    return RigidTransform(level, at);
  }

  // Weights of the corrections at `lift` and `put_down` in a frame.
  std::array<double, 2> Shares(int t) const {
    const double approach = kApproach_s * clip_.frame_rate;
    const auto share = [&](double before, double after) {
      return before < 0.0 ? 1.0 - MinimumJerk(-before / approach)
                          : 1.0 - MinimumJerk(before / std::max(1.0, kUpright * after));
    };
    return {share(t - times_.lift, times_.drink - times_.lift),
            share(times_.put_down - t, times_.put_down - times_.drink)};
  }

  // Sets the cup's track and the wrist that carries it.
  void MoveCup() {
    const Isometry3d held = report_.grasp.wrist_from_object;
    const std::array<int, 2> ends = {times_.lift, times_.put_down};
    std::array<Isometry3d, 2> stands;
    std::array<Vector3d, 2> turn, move;
    for (int e = 0; e < 2; ++e) {
      const Isometry3d carried = Wrist(ends[e]) * held;
      stands[e] = Standing(carried);
      turn[e] = LogSO3(stands[e].linear() * carried.linear().transpose());
      move[e] = stands[e] * marks_.middle - carried * marks_.middle;
    }
    clip_.object.emplace();
    clip_.object->trans.setZero(3, clip_.NumFrames());
    clip_.object->orient.setZero(3, clip_.NumFrames());
    clip_.object->name = cup_.object.name;
    clip_.holding_hand.assign(clip_.pose.size(), 0);
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      const auto [at_lift, at_end] = Shares(t);
      const Isometry3d wrist = Wrist(t), carried = wrist * held;
      const Vector3d middle = carried * marks_.middle + at_lift * move[0] + at_end * move[1];
      const Matrix3d R = ExpSO3(at_lift * turn[0] + at_end * turn[1]) * carried.linear();
      const Isometry3d cup = RigidTransform(R, middle - R * marks_.middle);
      if (at_lift > 0.0 || at_end > 0.0) MoveWristTo(cup * held.inverse(), wrist, t);
      const bool holds = t >= times_.lift && t <= times_.put_down;
      clip_.object->SetPose(t, holds ? cup : stands[t < times_.lift ? 0 : 1]);
      if (!holds) continue;
      clip_.holding_hand[t] = HoldingBit(times_.side);
      SetFingers(clip_.pose[t], times_.side, report_.grasp.fingers);
    }
  }

  void MoveWristTo(const Isometry3d& wanted, const Isometry3d& wrist, int t) {
    MoveWrist(surface_.RestJoints(), times_.side, wanted.linear(), wanted.translation(),
              clip_.trans.col(t), clip_.pose[t]);
    report_.wrist_shift_m =
        std::max(report_.wrist_shift_m, (wanted.translation() - wrist.translation()).norm());
    report_.wrist_turn_rad =
        std::max(report_.wrist_turn_rad, AngleBetween(wanted.linear(), wrist.linear()));
  }

  // Brings rim and lips together and apart. The hand moves, except for the last two centimeters:
  // people drink with the neck nearly upright.
  void MoveHead() {
    const Vector3d lips = LipsOf(face_);
    std::vector<Vector3d> own(clip_.pose.size());
    std::vector<Matrix3d> head(clip_.pose.size());
    const auto gap = [&](int t) {
      return Vector3d(own[t] - DrinkingEdge(marks_, clip_.object->Pose(t), own[t]));
    };
    for (int t = times_.lift; t <= times_.put_down; ++t) {
      const Isometry3d at = Head(t);
      head[t] = at.linear();
      own[t] = at * lips;
    }
    Eigen::VectorXd share = Eigen::VectorXd::Zero(clip_.NumFrames());
    int first = 0,
        last = 0;  // of drinking, which goes on while a drained cup leaves an upright head
    const auto set_shares = [&] {
      double nearest = 1e9;
      for (int t = times_.lift; t <= times_.put_down; ++t) {
        nearest = std::min(nearest, gap(t).norm());
      }
      for (int t = times_.lift; t <= times_.put_down; ++t) {
        const double beyond = gap(t).norm() - nearest - kLipsAt_m;
        share(t) = 1.0 - MinimumJerk(beyond / (kLipsFrom_m - kLipsAt_m));
      }
      first = times_.lift, last = times_.put_down;
      while (first < last && share(first) < 1.0) ++first;
      while (last > first && share(last) < 1.0) --last;
      share.segment(first, last - first + 1).setOnes();
    };
    set_shares();
    BringHand(first, last, gap);
    set_shares();
    const Matrix3Xd samples = CupSamples();
    const auto turn_head = [&] {
      std::vector<HeadWish> wishes(clip_.pose.size());
      for (int t = times_.lift; t <= times_.put_down; ++t) {
        if (share(t) <= 0.0) continue;
        const Isometry3d cup = clip_.object->Pose(t);
        const Vector3d way = -gap(t);
        wishes[t].lips = own[t] + share(t) * std::min(1.0, kHeadComes_m / way.norm()) * way;
        wishes[t].turn = share(t) * TurnTo(cup.linear().col(2), head[t]);
        wishes[t].points = cup * samples;
      }
      report_.head = PoseUnmarkedHead(body_.model, body_.betas, wishes, clip_);
    };
    const std::vector<JointPose> poses = clip_.pose;
    const ObjectTrack track = *clip_.object;
    turn_head();
    Vector3d shift = Vector3d::Zero();
    for (int give = 1; give <= kGives; ++give) {
      const Vector3d mouth = Head(times_.drink) * lips;
      const Vector3d left = mouth - DrinkingEdge(marks_, clip_.object->Pose(times_.drink), mouth);
      if (left.norm() < kLipsNear_m) return;
      shift += left;
      shift *= std::min(1.0, kHandGives_m / shift.norm());
      clip_.pose = poses;
      clip_.object = track;
      for (int t = times_.lift; t <= times_.put_down; ++t) {
        if (share(t) > 0.0) GiveHand(t, share(t) * shift, share(t) * give * kGive);
      }
      turn_head();
    }
  }

  // Moves the hand and the cup so that the gap is at most what the head closes: fully from `first`
  // to `last`, where the person drinks, and in part on the way there and back.
  void BringHand(int first, int last, const std::function<Vector3d(int)>& gap) {
    Matrix3Xd way(3, last - first + 1);
    for (int t = first; t <= last; ++t) {
      const Vector3d whole = gap(t);
      way.col(t - first) = std::max(0.0, 1.0 - kHeadComes_m / whole.norm()) * whole;
    }
    const int calm = static_cast<int>(std::lround(kHandCalm_s * clip_.frame_rate));
    for (int t = times_.lift; t <= times_.put_down; ++t) {
      const int at = std::clamp(t, first, last) - first, from = std::max(0, at - calm),
                to = std::min(last - first, at + calm);
      const Vector3d mean = way.middleCols(from, to - from + 1).rowwise().mean();
      const double before = double(t - times_.lift) / std::max(1, first - times_.lift),
                   after = double(times_.put_down - t) / std::max(1, times_.put_down - last);
      const Vector3d shift = MinimumJerk(before) * MinimumJerk(after) * mean;
      if (!shift.isZero(0.0)) GiveHand(t, shift, 0.0);
    }
  }

  // Tilts the cup less, about the drinking point, which leaves room for the nose.
  void GiveHand(int t, const Vector3d& shift, double upright_rad) {
    const Isometry3d wrist = Wrist(t), cup = clip_.object->Pose(t);
    const Vector3d edge = DrinkingEdge(marks_, cup, Head(t) * LipsOf(face_));
    const Vector3d across = Vector3d::UnitZ().cross(cup.linear().col(2)).normalized();
    const Isometry3d by = Eigen::Translation3d(edge + shift) *
                          Eigen::AngleAxisd(-upright_rad, across) * Eigen::Translation3d(-edge);
    clip_.object->SetPose(t, by * cup);
    MoveWristTo(by * wrist, wrist, t);
  }

  Isometry3d Head(int t) const {
    BodyState state;
    ForwardJoints(surface_.RestJoints(), clip_.pose[t], clip_.trans.col(t), state);
    return state.WorldFromJoint(kHead);
  }

  Matrix3Xd CupSamples() const {
    const Matrix3Xd& surface = cup_.fit.surface;
    const Eigen::Index every = std::max<Eigen::Index>(1, surface.cols() / kCupPoints);
    Matrix3Xd samples(3, (surface.cols() + every - 1) / every);
    for (Eigen::Index i = 0; i < samples.cols(); ++i) samples.col(i) = surface.col(i * every);
    return samples;
  }

  // Tilts the head back for a strongly tilted cup and turns it to the side that the cup comes from.
  static Vector3d TurnTo(const Vector3d& axis, const Matrix3d& head) {
    const double tilt = std::acos(std::clamp(axis.z(), -1.0, 1.0));
    const Vector3d from_cup = head.transpose() * Vector3d(axis.x(), axis.y(), 0.0);
    const double yaw = std::atan2(-from_cup.x(), -from_cup.z());
    return {-std::clamp(tilt - kFarTilt, 0.0, kMaxBack),
            std::sin(tilt) * std::clamp(yaw, -kMaxYaw, kMaxYaw), 0.0};
  }

  const ClipBody& body_;
  const PreparedObject& cup_;
  std::uint64_t seed_;
  Clip& clip_;
  const BodySurface surface_;
  const FaceMarks face_;
  const ObjectMarks marks_;
  DrinkTimes times_;
  std::optional<HandModel> hand_;
  std::optional<HandState> state_;
  double table_ = 0.0;
  DrinkReport report_;
};

}  // namespace

DrinkReport ServeDrink(const ClipBody& body, const PreparedObject& cup, std::uint64_t seed,
                       Clip& clip) {
  return DrinkServer(body, cup, seed, clip).Serve();
}

}  // namespace holdfast
