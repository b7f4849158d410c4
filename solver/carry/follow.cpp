// SPDX-License-Identifier: MIT
#include "solver/carry/follow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/conventions/hand_evidence.h"
#include "geometry/error.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/hand_object_score.h"
#include "solver/fit/clip_solver.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/finger_repair.h"
#include "solver/hand/hand_axes.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {
namespace {

constexpr double kGridError_m = 0.001;
constexpr double kGap_m = 0.05;  // maximum distance from hand skin to object; inside counts as 0
constexpr double kTogether_m_s = 1.5;  // maximum speed relative to the middle finger's root
constexpr double kWindow_s = 0.05;     // to either side, for speeds (least-squares slopes)
constexpr double kLeast_s = 0.1;       // shorter intervals are ignored
constexpr double kLying_m = 0.05;      // an object at most this high above the ground
constexpr double kLying_m_s = 0.1;     // and slower than this rests there and follows no hand

// Position of the hand as a whole: root of the middle finger.
Eigen::Matrix3Xd HandPlaces(const Clip& clip, const HandModel& hand) {
  Eigen::Matrix3Xd places(3, clip.NumFrames());
  BodyState joints;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(hand.Surface().RestJoints(), clip.pose[t], clip.trans.col(t), joints);
    places.col(t) = joints.joints.col(HandBegin(hand.HandSide()) + 3 * kMiddle);
  }
  return places;
}

void DropShort(int least, std::uint8_t bit, std::vector<std::uint8_t>& bits) {
  const auto frames = bits.size();
  for (std::size_t t = 0; t < frames; ++t) {
    if ((bits[t] & bit) == 0) continue;
    std::size_t end = t;
    while (end < frames && (bits[end] & bit) != 0) ++end;
    if (static_cast<int>(end - t) < least) {
      for (std::size_t u = t; u < end; ++u) bits[u] &= static_cast<std::uint8_t>(~bit);
    }
    t = end;
  }
}

}  // namespace

std::vector<double> SkinGaps(const Clip& clip, const HandModel& hand, const PreparedObject& object,
                             int threads) {
  std::vector<double> gaps(clip.pose.size(), std::numeric_limits<double>::infinity());
  ForEachPosedHand(clip, hand, threads, [&](int t, const HandState& state) {
    const Eigen::Matrix3Xd skin = clip.object->Pose(t).inverse() * state.Vertices();
    for (Eigen::Index i = 0; i < skin.cols(); ++i) {
      // Far away, the grid's value is a lower bound.
      if (object.fit.distance->Distance(skin.col(i)) - kGridError_m > gaps[t]) continue;
      gaps[t] = std::min(gaps[t], object.solid.distance.Distance(skin.col(i)));
    }
  });
  return gaps;
}

std::vector<std::uint8_t> FindFollows(const Clip& clip, std::span<const HandModel* const> hands,
                                      const PreparedObject& object, int threads) {
  if (!clip.object) {
    throw Error("clip", "has no object trajectory that could follow a hand",
                "Fit the object first");
  }
  const int frames = clip.NumFrames();
  const Eigen::Matrix3Xd& vertices = object.fit.vertices;
  const Eigen::Vector3d middle =
      0.5 * (vertices.rowwise().minCoeff() + vertices.rowwise().maxCoeff());
  Eigen::Matrix3Xd places(3, frames);
  Eigen::VectorXd lowest(frames);
  for (int t = 0; t < frames; ++t) {
    const Eigen::Isometry3d pose = clip.object->Pose(t);
    places.col(t) = pose * middle;
    lowest(t) = (pose * vertices).row(2).minCoeff();
  }
  const auto reach = std::max<Eigen::Index>(1, std::lround(kWindow_s * clip.frame_rate));
  const Eigen::Matrix3Xd velocity = clip.frame_rate * SlopesOverTime(places, reach);
  std::vector<std::uint8_t> follows(static_cast<std::size_t>(frames), 0);
  for (const HandModel* hand : hands) {
    if (hand->NumVertices() == 0) continue;
    const std::uint8_t bit = HoldingBit(hand->HandSide());
    const std::vector<double> gaps = SkinGaps(clip, *hand, object, threads);
    const Eigen::Matrix3Xd hand_velocity =
        clip.frame_rate * SlopesOverTime(HandPlaces(clip, *hand), reach);
    for (int t = 0; t < frames; ++t) {
      const bool lies = lowest(t) < kLying_m && velocity.col(t).norm() < kLying_m_s;
      if (!lies && gaps[t] <= kGap_m &&
          (velocity.col(t) - hand_velocity.col(t)).norm() <= kTogether_m_s) {
        follows[t] |= bit;
      }
    }
    DropShort(static_cast<int>(std::lround(kLeast_s * clip.frame_rate)), bit, follows);
  }
  return follows;
}

namespace {

constexpr double kRound = 0.02;       // relative radius tolerance of a ball
constexpr double kUnturned = 1e-6;    // radians
constexpr double kMoves_m = 0.05;     // shorter tracks are inconclusive
constexpr double kNear_m = 0.01;      // nearer skin may have to be adjusted
constexpr double kAround_s = 0.25;    // margin before and after
constexpr double kTipSlack_m = 0.05;  // of tips beyond the nearest skin, to be attracted
constexpr double kRelease_s = 0.02;   // hands return at once when they are no longer adjusted
constexpr double kAway_m = 1.0;
constexpr double kClean_m = 0.001;
constexpr double kUsualRate = 60.0;  // Hz, for the acceleration weight
constexpr double kMore = 4.0;        // factor of the penetration weight between solves
constexpr int kSolves = 4;
constexpr int kIterations = 20;  // per solve
constexpr double kTolerance = 1e-4;

class BallRefiner {
 public:
  BallRefiner(const Clip& clip, std::span<const HandModel* const> hands,
              const PreparedObject& object, std::span<const std::uint8_t> follows,
              const FitOptions& options)
      : clip_(clip),
        hands_(hands),
        object_(object),
        follows_(follows.begin(), follows.end()),
        options_(options) {
    // Hand vertices are dense enough for such a large ball: any penetration shows in the skin.
    options_.lambda_object_in_hand = 0.0;
    options_.lambda_penetration *= kMore;
    options_.lambda_acceleration *= std::pow(clip_.frame_rate / kUsualRate, 4);
    options_.max_iterations = kIterations;
    options_.function_tolerance = kTolerance;
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      Eigen::Isometry3d pose = clip_.object->Pose(t);
      const double lowest = (pose * object_.fit.vertices).row(2).minCoeff();
      pose.translation().z() += std::max(0.0, -lowest);
      clip_.object->SetPose(t, pose);
    }
  }

  RefineResult Run(const std::function<bool(int, int)>& progress) {
    std::vector<FittedFrame> fitted(clip_.pose.size());
    for (std::size_t t = 0; t < fitted.size(); ++t) {
      fitted[t].object = ObjectPose(clip_.object->Pose(static_cast<Eigen::Index>(t)));
      for (std::size_t h = 0; h < hands_.size(); ++h) {
        fitted[t].hands[h].fingers = FingersOf(clip_.pose[t], hands_[h]->HandSide());
      }
    }
    given_way_.assign(clip_.pose.size(), 0);
    std::vector<std::vector<ClipHold>> runs;
    for (std::size_t h = 0; h < hands_.size(); ++h) AddRuns(static_cast<int>(h), runs);
    RefineResult result;
    result.report.converged = true;
    result.report.frames.assign(fitted.size(), {});
    for (std::size_t k = 0; k < runs.size(); ++k) {
      if (progress && !progress(static_cast<int>(k), static_cast<int>(runs.size()))) return result;
      SolveRun(runs[k], fitted, result.report);
      if (result.report.failed) return result;
    }
    result.clip = ApplyFit(clip_, hands_, given_way_, fitted, kRelease_s);
    result.clip.holding_hand = follows_;
    result.touches = std::move(touches_);
    return result;
  }

 private:
  std::uint8_t Bit(int hand) const { return HoldingBit(hands_[hand]->HandSide()); }
  bool Follows(int hand, int t) const { return (follows_[t] & Bit(hand)) != 0; }

  // Solves one hand over successive frames, with growing penetration weight until it is resolved.
  void SolveRun(const std::vector<ClipHold>& holds, std::vector<FittedFrame>& fitted,
                ClipReport& report) const {
    const ClipProblem problem{clip_, hands_, object_.fit, holds, {}, false, true};
    FitOptions options = options_;
    ClipReport last;
    for (int solve = 0; solve < kSolves; ++solve) {
      last = SolveClip(problem, options, options.threads, fitted);
      if (solve == 0) report.cost_before += last.cost_before;
      report.iterations += last.iterations;
      report.solve_ms += last.solve_ms;
      report.failed |= last.failed;
      if (last.failed || Deepest(holds, fitted) < kClean_m) break;
      options.lambda_penetration *= kMore;
    }
    report.cost_after += last.cost_after;
    report.converged &= last.converged;
    for (std::size_t t = 0; t < last.frames.size(); ++t) report.frames[t] += last.frames[t];
  }

  // Maximum penetration of the skin into the ball in the frames of these holds, meters.
  double Deepest(const std::vector<ClipHold>& holds, const std::vector<FittedFrame>& fitted) const {
    const auto h = static_cast<std::size_t>(holds.front().hand);
    const HandModel& hand = *hands_[h];
    HandState state(hand);
    double deepest = 0.0;
    for (int t = holds.front().begin; t < holds.back().end; ++t) {
      JointPose pose = clip_.pose[t];
      Eigen::Vector3d trans = clip_.trans.col(t);
      MoveHand(hand, fitted[t].hands[h].offset, trans, pose);
      state.SetBody(pose, trans);
      state.Evaluate(fitted[t].hands[h].fingers, false);
      const Eigen::Matrix3Xd skin = clip_.object->Pose(t).inverse() * state.Vertices();
      for (Eigen::Index i = 0; i < skin.cols(); ++i) {
        deepest = std::max(deepest, -object_.fit.distance->Linear(skin.col(i)));
      }
    }
    return deepest;
  }

  // Adds runs of frames in which a hand is adjusted, split where the ball starts or ends following
  // it.
  void AddRuns(int hand, std::vector<std::vector<ClipHold>>& runs) {
    const HandModel& model = *hands_[hand];
    const std::vector<double> gaps = SkinGaps(clip_, model, object_, options_.threads);
    const int frames = clip_.NumFrames();
    const int around = static_cast<int>(std::lround(kAround_s * clip_.frame_rate));
    for (int t = 0; t < frames; ++t) {
      if (gaps[t] > kNear_m && !Follows(hand, t)) continue;
      for (int u = std::max(0, t - around); u < std::min(frames, t + around + 1); ++u) {
        given_way_[u] |= Bit(hand);
      }
    }
    const HandAnatomy anatomy(model);
    const auto gives_way = [&](int t) { return (given_way_[t] & Bit(hand)) != 0; };
    for (int t = 0; t < frames;) {
      if (!gives_way(t)) {
        ++t;
        continue;
      }
      if (t == 0 || !gives_way(t - 1)) runs.emplace_back();
      const bool follows = Follows(hand, t);
      int end = t;
      while (end < frames && gives_way(end) && Follows(hand, end) == follows) ++end;
      if (follows) touches_.push_back({model.HandSide(), t, end});
      runs.back().push_back(
          {hand, t, end, follows ? Touching(anatomy, t, end) : Eigen::Matrix3Xd(3, 0), follows});
      t = end;
    }
  }

  // Returns the hand in the ball's frame, with the contacts on the surface and the rest far away,
  // as ClipHold::at of a slipping hand.
  Eigen::Matrix3Xd Touching(const HandAnatomy& anatomy, int begin, int end) const {
    const HandModel& hand = anatomy.hand;
    HandState state(hand);
    std::vector<std::vector<double>> distances(static_cast<std::size_t>(hand.NumVertices()));
    Eigen::Matrix3Xd first;
    for (int t = begin; t < end; ++t) {
      state.SetBody(clip_.pose[t], clip_.trans.col(t));
      state.Evaluate(FingersOf(clip_.pose[t], hand.HandSide()), false);
      const Eigen::Matrix3Xd skin = clip_.object->Pose(t).inverse() * state.Vertices();
      if (t == begin) first = skin;
      for (Eigen::Index i = 0; i < skin.cols(); ++i) {
        distances[i].push_back(object_.solid.distance.Distance(skin.col(i)));
      }
    }
    std::vector<double> usual;
    for (std::vector<double>& of_vertex : distances) usual.push_back(Median(std::move(of_vertex)));
    const auto nearest = std::ranges::min_element(usual) - usual.begin();
    std::vector<int> touching = {static_cast<int>(nearest)};
    for (int finger = 0; finger < kNumFingers; ++finger) {
      const int pad = anatomy.landmarks.PadCenter(finger);
      if (usual[pad] < usual[nearest] + kTipSlack_m) touching.push_back(pad);
    }
    Eigen::Matrix3Xd at = first.array() + kAway_m;
    for (const int i : touching) at.col(i) = OnSurface(first.col(i));
    return at;
  }

  Eigen::Vector3d OnSurface(Eigen::Vector3d point) const {
    constexpr int kSteps = 10;
    for (int step = 0; step < kSteps; ++step) {
      Eigen::Vector3d gradient;
      const double distance = object_.fit.distance->Distance(point, &gradient);
      point -= distance * gradient / std::max(gradient.squaredNorm(), 1e-6);
    }
    return point;
  }

  Clip clip_;  // with the ball above the ground
  std::span<const HandModel* const> hands_;
  const PreparedObject& object_;
  std::vector<std::uint8_t> follows_;
  FitOptions options_;
  std::vector<std::uint8_t> given_way_;
  std::vector<RefinedTouch> touches_;
};

}  // namespace

bool IsUnturnedBall(const Clip& clip, const TriangleMesh& object) {
  if (!clip.object || object.NumVertices() == 0) return false;
  const ObjectTrack& track = *clip.object;
  const auto changes = [](const Eigen::Matrix3Xd& columns) {
    return (columns.rowwise().maxCoeff() - columns.rowwise().minCoeff()).maxCoeff();
  };
  if (changes(track.orient) > kUnturned || changes(track.trans) < kMoves_m) return false;
  const Eigen::Vector3d middle =
      0.5 * (object.vertices.rowwise().minCoeff() + object.vertices.rowwise().maxCoeff());
  const Eigen::VectorXd radii = (object.vertices.colwise() - middle).colwise().norm();
  return radii.minCoeff() > (1.0 - kRound) * radii.maxCoeff();
}

FingertipCounts CountFingertips(const Clip& clip, std::span<const HandModel* const> hands,
                                const PreparedObject& object,
                                std::span<const std::uint8_t> follows) {
  const double touch_m = 1e-3 * ContactProtocol().contact_threshold_mm;
  FingertipCounts counts;
  for (const HandModel* hand : hands) {
    const HandAnatomy anatomy(*hand);
    HandState state(*hand);
    for (int t = 0; t < clip.NumFrames(); ++t) {
      if ((follows[t] & HoldingBit(hand->HandSide())) == 0) continue;
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], hand->HandSide()), false);
      const Eigen::Isometry3d object_from_world = clip.object->Pose(t).inverse();
      for (int finger = 0; finger < kNumFingers; ++finger) {
        double gap = std::numeric_limits<double>::infinity();
        for (const int i : anatomy.landmarks.Pad(3 * finger + 2)) {
          const Eigen::Vector3d point = object_from_world * state.Vertices().col(i);
          gap = std::min(gap, object.solid.distance.Distance(point));
        }
        ++(gap < -1e-3 * kDeep_mm ? counts.inside : gap < touch_m ? counts.touch : counts.beside);
      }
    }
  }
  return counts;
}

RefineResult RefineBall(const Clip& clip, std::span<const HandModel* const> hands,
                        const PreparedObject& object, std::span<const std::uint8_t> follows,
                        const FitOptions& options, const std::function<bool(int, int)>& progress) {
  if (!clip.object) {
    throw Error("clip", "has no object trajectory to refine",
                "Make one with 'holdfast fit', or give a clip with object_trans and object_orient");
  }
  return BallRefiner(clip, hands, object, follows, options).Run(progress);
}

}  // namespace holdfast
