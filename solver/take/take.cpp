// SPDX-License-Identifier: MIT
#include "solver/take/take.h"

#include <algorithm>
#include <array>
#include <utility>

#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/score/hand_object_score.h"
#include "solver/fit/clip_state.h"
#include "solver/take/take_measures.h"

namespace holdfast {
namespace {

constexpr int kAttempts = 3;
constexpr int kLookedAt = 4;             // motions per attempt for which a table is placed
constexpr double kLaterMotion = 0.03;    // of score: the motion maker puts its best first
constexpr double kBodyInTable_m = 0.02;  // more than this may be fixed by another attempt
constexpr double kLedByHand =
    2000.0;  // FitOptions::lambda_object: relative to the object's motion with the hand
constexpr double kMissed_m = 0.02;  // a hand farther from the grasp holds nothing

// A motion that takes the object, and a table that avoids the body.
struct Candidate {
  TakeMotion motion;
  TablePlacement table;
  int attempt = 0;
  int index = 0;  // within its attempt
  double score = -1e9;

  bool Serves() const { return motion.fault.empty() && table.deepest_m <= kBodyInTable_m; }
};

double MarginOf(const TriangleMesh& mesh) {
  return std::min(0.2, 0.5 * Extent(mesh).head<2>().norm() + 0.01);
}

// Returns the best motion of an attempt.
Candidate BestOf(const std::vector<TakeBodyMotion>& motions, const TakePlan& plan,
                 const HandModel& hand, const BodySurface& body, const TakeObject& object,
                 const Clip& like, int threads) {
  std::vector<Candidate> all;
  all.resize(motions.size());
  ParallelFor(static_cast<int>(motions.size()), threads, [&](int i) {
    all[i].motion = MakeTakeMotion(plan, motions[i], hand, object, like);
    all[i].index = i;
    all[i].score = all[i].motion.score - kLaterMotion * i;
  });
  std::ranges::stable_sort(
      all, [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  Candidate best;
  best.motion.fault = "no motion was made";
  for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), kLookedAt); ++i) {
    if (all[i].motion.clip.NumFrames() == 0) {
      if (i == 0) best = std::move(all[i]);
      continue;
    }
    const Eigen::Vector3d place = plan.places.front();
    all[i].table = PlaceTable(place, plan.approach_yaw_rad, MarginOf(object.mesh),
                              SkinNearTable(all[i].motion.clip, body, place, threads));
    all[i].score -= 100.0 * all[i].table.deepest_m;
    if (all[i].score > best.score) best = std::move(all[i]);
  }
  return best;
}

void StandTable(const SideTable& table, Clip& clip) {
  ObjectTrack track;
  track.name = "table";
  track.mesh = "table.ply";
  track.trans = table.world_from_table.translation().replicate(1, clip.NumFrames());
  track.orient = LogSO3(table.world_from_table.linear()).replicate(1, clip.NumFrames());
  clip.table = std::move(track);
}

// Measures the drift of the held object: of its pose in the wrist's frame from that of the grasp.
void MeasureWandering(const BodySurface& body, Side side, TakeReport& report) {
  const Clip& clip = report.clip;
  const Eigen::Isometry3d& grasp = report.motion.take.grasp.wrist_from_object;
  BodyState state;
  for (int t = report.motion.times.take; t < clip.NumFrames(); ++t) {
    ForwardJoints(body.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    const int wrist = WristJoint(side);
    const Eigen::Matrix3d rotation =
        state.world_rotation[wrist].transpose() * ExpSO3(clip.object->orient.col(t));
    const Eigen::Vector3d position = state.world_rotation[wrist].transpose() *
                                     (clip.object->trans.col(t) - state.joints.col(wrist));
    report.wanders_mm =
        std::max(report.wanders_mm, 1000.0 * (position - grasp.translation()).norm());
    report.wanders_deg =
        std::max(report.wanders_deg, AngleBetween(rotation, grasp.linear()) / kDegree);
  }
}

// All stages of one take.
class TakePipeline {
 public:
  TakePipeline(const TakeRequest& request, const TakeStart& start, const PreparedObject& prepared,
               const StagedProgress& progress)
      : request_(request),
        start_(start),
        prepared_(prepared),
        progress_(progress),
        object_{prepared.object.mesh, prepared.solid.distance, *prepared.fit.distance},
        hand_(start.body, start.betas, request.side),
        body_(start.body, start.betas) {
    request_.pelvis = start.pelvis;
  }

  TakeReport Run(const BodyMotionMaker& motion) {
    report_.plan = PlanTake(request_, hand_, object_, [&](double share) {
      return GoesOn("grasp", static_cast<int>(100 * share), 100);
    });
    if (stopped_) return std::move(report_);
    if (!report_.plan.Found()) return Ended(TakeStatus::kNoGrasp);
    if (!report_.plan.take.fault.empty()) {
      report_.notes.push_back("no grasp is quite right: " + report_.plan.take.fault);
    }
    ChooseMotion(motion);
    if (stopped_) return std::move(report_);
    const TakeMotion& chosen = report_.motion;
    if (chosen.clip.NumFrames() == 0) return Ended(TakeStatus::kNoMotion);
    if (chosen.take_wrist_error_m > kMissed_m) return Ended(TakeStatus::kMissed);
    if (!chosen.fault.empty()) report_.notes.push_back("the take: " + chosen.fault);
    Fit();
    if (stopped_) return std::move(report_);
    Measure();
    if (stopped_) return std::move(report_);
    return Ended(TakeStatus::kTaken);
  }

 private:
  TakeReport Ended(TakeStatus status) {
    report_.status = status;
    return std::move(report_);
  }

  bool GoesOn(const char* stage, int done, int total) {
    if (progress_ && !progress_(stage, done, total)) stopped_ = true;
    return !stopped_;
  }

  void ChooseMotion(const BodyMotionMaker& motion) {
    Candidate best;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::vector<TakeBodyMotion> motions = motion(report_.plan, attempt);
      if (!GoesOn("motion", attempt + 1, kAttempts)) return;
      Candidate found =
          BestOf(motions, report_.plan, hand_, body_, object_, start_.like, request_.threads);
      found.attempt = attempt;
      if (attempt == 0 || found.score > best.score) best = std::move(found);
      if (best.Serves()) break;
    }
    report_.motion = std::move(best.motion);
    report_.table = best.table.table;
    report_.attempt = best.attempt;
    report_.index = best.index;
  }

  void Fit() {
    FitOptions fit;
    fit.threads = request_.threads;
    fit.lambda_object = kLedByHand;
    std::vector<FrameReport> frames;
    Clip& clip = report_.clip;
    clip = FitTaken(report_.motion, hand_, prepared_.fit, fit, &frames,
                    [&](int done, int total) { return GoesOn("fit", done, total); });
    if (stopped_) return;
    clip.object->name = prepared_.object.name;
    clip.object->mesh = "object.ply";
    clip.action = "take";
    if (clip.betas.size() == 0 || clip.betas.isZero(0.0)) clip.body_model = start_.body->Name();
    StandTable(report_.table, clip);
  }

  void Measure() {
    const Clip& clip = report_.clip;
    const TakeTimes& times = report_.motion.times;
    std::vector<std::uint8_t> holding(static_cast<std::size_t>(clip.NumFrames()), 0);
    std::fill(holding.begin() + times.take, holding.end(), HoldingBit(request_.side));
    ContactProtocol protocol;
    protocol.threads = request_.threads;
    const std::array<const HandModel*, 1> hands{&hand_};
    report_.contact = ScoreContact(
        MeasureHands(clip, hands, holding, prepared_.solid, protocol,
                     [&](int done, int total) { return GoesOn("metrics", done, total); }));
    if (stopped_) return;
    report_.measured = MeasureTake(clip, body_, request_.side, object_, report_.table, times.take,
                                   times.goals, report_.plan.places, request_.threads);
    MeasureWandering(body_, request_.side, report_);
  }

  TakeRequest request_;
  const TakeStart& start_;
  const PreparedObject& prepared_;
  const StagedProgress& progress_;
  TakeObject object_;
  HandModel hand_;
  BodySurface body_;
  bool stopped_ = false;
  TakeReport report_;
};

}  // namespace

TakeReport TakeFromTable(const TakeRequest& request, const TakeStart& start,
                         const PreparedObject& object, const BodyMotionMaker& motion,
                         const StagedProgress& progress) {
  return TakePipeline(request, start, object, progress).Run(motion);
}

double DeepestOver(const ContactScore& contact, int begin, int end) {
  double deepest = 0.0;
  for (int t = begin; t < end; ++t) deepest = std::max(deepest, contact.frames[t].penetration_mm);
  return deepest;
}

}  // namespace holdfast
