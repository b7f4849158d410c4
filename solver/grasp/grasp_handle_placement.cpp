// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_handle_placement.h"
#include "geometry/rotation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

namespace holdfast {
namespace {

constexpr double kGive = 0.0010;          // allowed initial penetration: refinement resolves it
constexpr double kNear = 0.004;           // length scale: a pad this near is nearly in contact
constexpr double kFar = 5.0 * kNear;      // beyond this distance a pad counts nothing
constexpr std::size_t kMaxBalls = 16;     // per finger
constexpr double kTurn = 16.0 * kDegree;  // step of rotation about the bar
constexpr int kTurns = 5;                 // steps in each sense: the palm stays outside
constexpr std::size_t kBestOfTurn = 3;    // placements kept per rotation
constexpr double kFan[kNumFingers] = {-3.0, 0.0, 7.0, 3.0, 0.0};  // nearly parallel, degrees

constexpr int kSideBySide[kThumb] = {kIndex, kMiddle, kRing, kPinky};
// Worth of a touching pad, of a finger through the opening and of one outside.
constexpr double kThrough = 0.4, kOutside = 0.15, kDiscomfort = 0.08;
constexpr double kMaxOfThumb = 1.0, kMaxOfPalm = 0.6;
constexpr double kRounding = 1e-9;
constexpr double kNoGap = std::numeric_limits<double>::infinity();

double Squared(double x) { return x * x; }

// 1 where a pad touches, 0 far from it.
double Nearness(double gap) { return std::exp(-std::max(gap, 0.0) / kNear); }

Eigen::Matrix3d Columns(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c) {
  Eigen::Matrix3d m;
  m << a, b, c;
  return m;
}

// The same handle in another frame.
Handle Moved(const Eigen::Isometry3d& motion, const Handle& handle) {
  Handle moved = handle;
  moved.bar = motion * handle.bar;
  moved.along = motion.linear() * handle.along;
  moved.inward = motion.linear() * handle.inward;
  moved.through = motion.linear() * handle.through;
  return moved;
}

}  // namespace

Eigen::Matrix<double, 3, 4> FingerChain(const HandAxes& axes, const HandState& state, int finger) {
  const int last = 3 * finger + 2;
  Eigen::Matrix<double, 3, 4> chain;
  chain.leftCols<3>() = state.JointPositions().middleCols<3>(3 * finger);
  chain.col(3) = chain.col(2) + state.JointRotation(last) *
                                    (axes.RestTips().col(finger) - axes.RestJoints().col(last));
  return chain;
}

std::array<bool, kNumFingers> FingersThrough(const HandAxes& axes, const HandState& state,
                                             const Handle& handle,
                                             const Eigen::Isometry3d& wrist_from_object) {
  std::array<bool, kNumFingers> through{};
  for (int finger = 0; finger < kThumb; ++finger) {
    through[finger] =
        PassesThrough(handle, wrist_from_object.inverse() * FingerChain(axes, state, finger));
  }
  return through;
}

HandlePlacer::HandlePlacer(const HandAnatomy& anatomy) : anatomy_(anatomy) {
  const HandAxes& axes = anatomy.axes;
  HandEvaluation hand = AtWrist(anatomy.hand);
  for (const double root : {-8.0, 12.0, 32.0, 52.0, 72.0}) {
    for (const double middle : {25.0, 45.0, 62.0, 80.0, 98.0}) {
      HandAngles angles = OpenHand(axes);
      for (int finger = 0; finger < kThumb; ++finger) {
        const double flexion[3] = {root, middle, 2.0 / 3.0 * middle};
        for (int j = 0; j < 3; ++j) {
          angles(0, 3 * finger + j) = flexion[j] * kDegree - axes.RestFlexion(3 * finger + j);
        }
        angles(1, 3 * finger) = kFan[finger] * kDegree;
      }
      angles = axes.Clamp(angles);
      for (int finger = 0; finger < kThumb; ++finger) {
        curls_[finger].push_back(Posed(hand, angles, finger));
      }
    }
  }
  for (int n = 1; n < kThumb; ++n) {
    for (int c = 0; c < kCurls; ++c) {
      for (int b = 0; b < kCurls; ++b) {
        const std::array<double, 3>& own = curls_[kSideBySide[n]][c].flexion;
        const std::array<double, 3>& before = curls_[kSideBySide[n - 1]][b].flexion;
        unlike_[n][c][b] = 0.25 * (Squared(own[0] - before[0]) + Squared(own[1] - before[1]));
      }
    }
  }
  for (const double flexion : {-20.0, -5.0, 15.0, 35.0}) {
    for (const double abduction : {-5.0, 15.0, 35.0, 50.0}) {
      for (const double bend : {0.0, 25.0, 50.0}) {
        HandAngles angles = OpenHand(axes, flexion, abduction);
        angles(0, 3 * kThumb + 1) = 0.5 * bend * kDegree;
        angles(0, 3 * kThumb + 2) = bend * kDegree;
        curls_[kThumb].push_back(Posed(hand, axes.Clamp(angles), kThumb));
      }
    }
  }
  const Eigen::Matrix3Xd& vertices = hand.At(axes.PoseOf(OpenHand(axes))).Vertices();
  palm_.resize(3, vertices.cols());
  Eigen::Index count = 0;
  for (int i = 0; i < anatomy.hand.NumVertices(); i += 2) {
    const int part = anatomy.landmarks.PartOf(i);
    if (part == kPalmPart || part == 3 * kThumb) palm_.col(count++) = vertices.col(i);
  }
  palm_.conservativeResize(3, count);
  palm_patches_ = PointPatches(palm_);
}

HandlePlacer::Curl HandlePlacer::Posed(HandEvaluation& hand, const HandAngles& angles,
                                       int finger) const {
  const HandAxes& axes = anatomy_.axes;
  const HandState& state = hand.At(axes.PoseOf(angles));
  Curl curl;
  curl.discomfort = 0.0;
  const HandAngles relaxed = axes.Relaxed();
  for (int j = 0; j < 3; ++j) {
    curl.flexion[j] = angles(0, 3 * finger + j);
    curl.abduction[j] = angles(1, 3 * finger + j);
    curl.discomfort += Squared(curl.flexion[j] - relaxed(0, 3 * finger + j)) / 3.0;
  }
  curl.chain = FingerChain(axes, state, finger);
  Eigen::Matrix3Xd centers;
  BallCenters(anatomy_.landmarks, state.Vertices(), centers);
  for (std::size_t b = 0; b < anatomy_.landmarks.Balls().size(); ++b) {
    const FingerBall& ball = anatomy_.landmarks.Balls()[b];
    if (ball.finger_joint / 3 != finger) continue;
    curl.balls.push_back(
        {centers.col(b),
         state.JointRotation(ball.finger_joint) * axes.PadDirection(ball.finger_joint), ball.radius,
         ball.finger_joint % 3});
  }
  constexpr double kTipRadius = 0.0045;
  const Eigen::Vector3d end = (curl.chain.col(3) - curl.chain.col(2)).normalized();
  curl.balls.push_back(
      {curl.chain.col(3) - kTipRadius * end, curl.balls.back().pad, kTipRadius, 2});
  return curl;
}

// Clearances between the object and the balls of one finger, for successive curls. Most balls are
// far away; a neighboring ball or the same ball of another curl shows this without a query.
class HandlePlacer::Gaps {
 public:
  Gaps(const DistanceGrid& object, const Eigen::Isometry3d& object_from_wrist)
      : object_(object), object_from_wrist_(object_from_wrist) {}

  // False if a ball is in the object; tests the last such ball first, then from the tip.
  bool Measure(const Curl& curl) {
    if (last_in_ < curl.balls.size()) {
      const Ball& ball = curl.balls[last_in_];
      const Seen& seen = seen_[last_in_];
      if (!IsFar(seen, ball) && See(last_in_, ball).distance - ball.radius < -kGive) return false;
    }
    const Seen* beside = nullptr;
    for (std::size_t b = curl.balls.size(); b-- > 0;) {
      const Ball& ball = curl.balls[b];
      gaps_[b] = kNoGap;
      if (IsFar(seen_[b], ball) || (beside != nullptr && IsFar(*beside, ball))) continue;
      beside = &See(b, ball);
      gaps_[b] = beside->distance - ball.radius;
      if (gaps_[b] < -kGive) {
        last_in_ = b;
        return false;
      }
    }
    return true;
  }

  // Of a ball; infinite beyond kFar.
  double Gap(std::size_t ball) const { return gaps_[ball] > kFar ? kNoGap : gaps_[ball]; }
  // Cosine between the direction of the ball's pad and the direction to the surface.
  double Facing(const Curl& curl, std::size_t ball) const {
    return -(object_from_wrist_.linear() * curl.balls[ball].pad).dot(seen_[ball].outward);
  }
  const Eigen::Isometry3d& ObjectFromWrist() const { return object_from_wrist_; }

 private:
  struct Seen {
    Eigen::Vector3d center = Eigen::Vector3d::Constant(kNoGap);
    Eigen::Vector3d outward;
    double distance = -kNoGap;
  };

  static bool IsFar(const Seen& seen, const Ball& ball) {
    constexpr double kSteepest = 1.05;  // maximum slope of interpolated distances
    const double way = (seen.distance - ball.radius - kFar) / kSteepest;
    return way > 0.0 && (seen.center - ball.center).squaredNorm() < way * way;
  }

  const Seen& See(std::size_t b, const Ball& ball) {
    Seen& seen = seen_[b];
    if (seen.center != ball.center) {
      seen.center = ball.center;
      seen.distance = object_.Linear(object_from_wrist_ * ball.center, &seen.outward);
    }
    return seen;
  }

  const DistanceGrid& object_;
  const Eigen::Isometry3d& object_from_wrist_;
  std::array<double, kMaxBalls> gaps_;
  std::array<Seen, kMaxBalls> seen_;
  std::size_t last_in_ = kMaxBalls;
};

HandlePlacer::Fit HandlePlacer::TryFinger(const Curl& curl, const Handle& handle_in_wrist,
                                          Gaps& gaps) {
  if (!gaps.Measure(curl)) return {};
  std::array<double, 3> touch = {kNoGap, kNoGap, kNoGap};  // minimum clearances
  double knuckles = kNoGap;
  for (std::size_t b = 0; b < curl.balls.size(); ++b) {
    const double gap = gaps.Gap(b);
    if (gap == kNoGap) continue;
    double& pad = touch[curl.balls[b].phalanx];
    if (gap >= std::max(pad, knuckles)) continue;
    const double facing = gaps.Facing(curl, b);
    if (facing > 0.35) pad = std::min(pad, gap);
    if (facing < -0.2) knuckles = std::min(knuckles, gap);
  }
  Fit fit;
  fit.through = PassesThrough(handle_in_wrist, curl.chain);
  const double touching = Nearness(touch[0]) + Nearness(touch[1]) + Nearness(touch[2]);
  fit.worth = (fit.through ? 1.0 + kThrough * touching : kOutside * touching) -
              0.25 * Nearness(knuckles) - kDiscomfort * curl.discomfort;
  return fit;
}

HandlePlacer::MostByFinger HandlePlacer::MostOfFingers(const Handle& handle_in_wrist) const {
  MostByFinger most;
  for (int n = 0; n < kThumb; ++n) {
    most[n] = -1e9;
    for (const Curl& curl : curls_[kSideBySide[n]]) {
      const double outside = 3.0 * kOutside - kDiscomfort * curl.discomfort;
      const double through = 1.0 + 3.0 * (kThrough - kOutside);  // upper bound
      if (outside + through <= most[n]) continue;
      most[n] =
          std::max(most[n], outside + (PassesThrough(handle_in_wrist, curl.chain) ? through : 0.0));
    }
  }
  return most;
}

double HandlePlacer::TryThumb(const Curl& curl, const Handle& handle, Gaps& gaps) {
  if (!gaps.Measure(curl)) return -1e9;
  double touch = 0.0;
  for (std::size_t b = 0; b < curl.balls.size(); ++b) {
    const Ball& ball = curl.balls[b];
    const double gap = gaps.Gap(b);
    if (ball.phalanx != 2 || gap == kNoGap) continue;
    // On the bar, not elsewhere on the object.
    const double beside =
        std::max(0.0, (gaps.ObjectFromWrist() * ball.center - handle.bar).norm() - 0.045);
    touch = std::max(
        touch, std::max(0.0, gaps.Facing(curl, b)) * Nearness(gap) * std::exp(-beside / 0.02));
  }
  return touch - 0.1 * curl.discomfort;
}

// Best combination of curls, with neighbors alike. Each finger has a curl that is free.
std::pair<double, std::array<int, kThumb>> HandlePlacer::Choose(const Fits& fits) const {
  std::array<std::array<int, kCurls>, kThumb> from{};
  std::array<double, kCurls> worth{}, next;
  for (int n = 0; n < kThumb; ++n) {
    next.fill(-1e9);
    for (int c = 0; c < kCurls; ++c) {
      if (fits[n][c].worth < -1e8) continue;
      double best = n == 0 ? 0.0 : -1e9;
      for (int b = 0; b < kCurls && n > 0; ++b) {
        if (worth[b] - unlike_[n][c][b] > best) {
          best = worth[b] - unlike_[n][c][b];
          from[n][c] = b;
        }
      }
      next[c] = best + fits[n][c].worth;
    }
    worth = next;
  }
  auto chosen = static_cast<int>(std::max_element(worth.begin(), worth.end()) - worth.begin());
  std::pair<double, std::array<int, kThumb>> choice{worth[chosen], {}};
  for (int n = kThumb - 1; n >= 0; --n) {
    choice.second[n] = chosen;
    chosen = from[n][chosen];
  }
  return choice;
}

// Chooses fingers and thumb of a hand whose palm is free. False if they are not free, or if the
// placement's prior, including the palm's `palm`, is not greater than `least`.
bool HandlePlacer::TryFingers(const Handle& handle, const DistanceGrid& object, double palm,
                              double least, const MostByFinger& most_of,
                              Placement& placement) const {
  const Eigen::Isometry3d object_from_wrist = placement.wrist_from_object.inverse();
  const Handle in_wrist = Moved(placement.wrist_from_object, handle);
  Fits fits;
  double most = std::accumulate(most_of.begin(), most_of.end(), palm + kMaxOfThumb + kRounding);
  for (int n = 0; n < kThumb; ++n) {
    Gaps gaps(object, object_from_wrist);
    double best = -1e9;
    for (int c = 0; c < kCurls; ++c) {
      fits[n][c] = TryFinger(curls_[kSideBySide[n]][c], in_wrist, gaps);
      best = std::max(best, fits[n][c].worth);
    }
    most += best - most_of[n];
    if (best < -1e8 || most <= least) return false;
  }
  const auto [worth, curls] = Choose(fits);
  if (worth < 0.0 || worth + palm + kMaxOfThumb + kRounding <= least) return false;
  placement.prior = worth + palm;
  placement.start = OpenHand(anatomy_.axes);
  placement.closing = {};
  const auto take = [&](const Curl& curl, int finger) {
    for (int j = 0; j < 3; ++j) {
      placement.start(0, 3 * finger + j) = curl.flexion[j];
      placement.start(1, 3 * finger + j) = curl.abduction[j];
    }
  };
  for (int n = 0; n < kThumb; ++n) {
    take(curls_[kSideBySide[n]][curls[n]], kSideBySide[n]);
    placement.closing[kSideBySide[n]] = fits[n][curls[n]].through;
  }
  if (std::ranges::count(placement.closing, true) == 0) return false;
  double best = -1e9;
  Gaps gaps(object, object_from_wrist);
  for (const Curl& curl : curls_[kThumb]) {
    const double thumb = TryThumb(curl, handle, gaps);
    if (thumb <= best) continue;
    best = thumb;
    take(curl, kThumb);
  }
  placement.closing[kThumb] = true;
  placement.prior += best;
  return best > -1e8 && placement.prior > least;
}

// Knuckles must stay outside: a bar is not held with fingers that come from within the opening.
bool HandlePlacer::KnucklesOutside(const Handle& handle_in_wrist) const {
  return std::ranges::none_of(std::array{kIndex, kPinky}, [&](int finger) {
    const Eigen::Vector3d knuckle = curls_[finger].front().chain.col(0);
    return (knuckle - handle_in_wrist.bar).dot(handle_in_wrist.inward) > 0.0;
  });
}

// Returns the best hands of one rotation. The bar lies across the palm with the index finger at one
// end; rotations about the bar take the palm all the way around it.
std::vector<Placement> HandlePlacer::PlaceTurned(std::span<const Handle> handles, int index,
                                                 double sign, double angle,
                                                 const DistanceGrid& object) const {
  const Handle& handle = handles[index];
  const HandAxes& axes = anatomy_.axes;
  const double palm = anatomy_.landmarks.PalmCenter().dot(axes.PalmNormal());
  const double half = 0.5 * std::max(handle.thickness, handle.width);
  const Eigen::Vector3d along = sign * handle.along;
  const Eigen::Vector3d normal = std::cos(angle) * handle.inward + std::sin(angle) * handle.through;
  // Nor is the palm over the opening as seen from other parts of the same bar: a curved bar would
  // be held from above a mug's rim.
  constexpr double kSameHandle = 0.05, kOver = 0.022;
  const auto outside = [&](const Eigen::Isometry3d& wrist_from_object) {
    const Eigen::Vector3d palm_center =
        wrist_from_object.inverse() * anatomy_.landmarks.PalmCenter();
    return std::ranges::none_of(handles, [&](const Handle& other) {
      return (other.bar - handle.bar).norm() < kSameHandle &&
             (palm_center - other.bar).dot(other.inward) > kOver;
    });
  };
  struct Pose {
    Eigen::Isometry3d wrist_from_object;
    MostByFinger most_of;
    double most;
  };
  std::vector<Pose> poses;
  for (const double tilt : {0.0, 20.0 * kDegree, -20.0 * kDegree}) {
    const Eigen::Matrix3d tilted = Eigen::AngleAxisd(tilt, axes.PalmNormal()).toRotationMatrix();
    const Eigen::Vector3d across = tilted * axes.Across();
    const Eigen::Vector3d forward = tilted * axes.Forward();
    Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
    const Eigen::Matrix3d hand =
        Columns(across, axes.PalmNormal(), across.cross(axes.PalmNormal()));
    wrist_from_object.linear() = hand * Columns(along, normal, along.cross(normal)).transpose();
    const Eigen::Vector3d middle = handle.bar + 0.5 * (handle.low + handle.high) * handle.along;
    for (double height = palm + half; height < palm + half + 0.027; height += 0.0085) {
      for (double ahead = 0.065; ahead < 0.125; ahead += 0.0115) {
        // Selects the finger at the center of the opening.
        for (double beside = -0.045; beside < 0.035; beside += 0.013) {
          const Eigen::Vector3d bar =
              ahead * forward + height * axes.PalmNormal() + beside * across;
          wrist_from_object.translation() = bar - wrist_from_object.linear() * middle;
          const Handle in_wrist = Moved(wrist_from_object, handle);
          if (!outside(wrist_from_object) || !KnucklesOutside(in_wrist)) continue;
          const MostByFinger most_of = MostOfFingers(in_wrist);
          poses.push_back(
              {wrist_from_object, most_of, std::accumulate(most_of.begin(), most_of.end(), 0.0)});
        }
      }
    }
  }
  // Poses with the highest upper bound come first, so that the rest can be pruned.
  std::ranges::stable_sort(poses, std::greater(), &Pose::most);
  std::vector<Placement> best;
  for (const Pose& pose : poses) {
    const bool full = best.size() == kBestOfTurn;
    const double least = full ? best.back().prior : -kNoGap;
    if (pose.most + kMaxOfPalm + kMaxOfThumb + kRounding <= least) break;
    Placement placement{GraspStyle::kHandle, pose.wrist_from_object, {}, handle.thickness, 0.0};
    placement.handle = index;
    const Eigen::Isometry3d object_from_wrist = pose.wrist_from_object.inverse();
    const double palm_gap = palm_patches_.Least(
        [&](int i) { return object.Linear(object_from_wrist * palm_.col(i)); }, 1.0, -kGive);
    if (palm_gap < -kGive ||
        !TryFingers(handle, object, kMaxOfPalm * std::exp(-std::max(palm_gap, 0.0) / 0.008), least,
                    pose.most_of, placement)) {
      continue;
    }
    if (full) best.pop_back();
    best.insert(
        std::ranges::upper_bound(best, placement.prior, std::ranges::greater(), &Placement::prior),
        placement);
  }
  return best;
}

std::vector<Placement> HandlePlacer::Place(std::span<const Handle> handles, int index,
                                           const DistanceGrid& object) const {
  std::vector<Placement> placements;
  for (const double sign : {1.0, -1.0}) {
    for (int turn = -kTurns; turn <= kTurns; ++turn) {
      const std::vector<Placement> of_turn =
          PlaceTurned(handles, index, sign, kTurn * turn, object);
      placements.insert(placements.end(), of_turn.begin(), of_turn.end());
    }
  }
  return placements;
}

}  // namespace holdfast
