// SPDX-License-Identifier: MIT
#include "generator/training/wandr/window_sampler.h"

#include <algorithm>
#include <cmath>

#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

constexpr int kSoonest = 15, kLatest = 240;  // frames to a hindsight goal
constexpr double kSureWithin = 30.0;         // frames before a deadline that are told rightly
constexpr float kHeightPerAngle = 0.15f;     // meters the body is too high or low, per radian
constexpr int kLegs[] = {0, 1, 2, 4, 5, 7, 8, 10, 11};

}  // namespace

WindowSampler::WindowSampler(const Corpus& corpus, const BoneOffsets<float>& bones, Side wrist,
                             const GoalMixture& mixture)
    : corpus_(corpus), bones_(bones), wrist_(wrist), mixture_(mixture) {
  if (corpus.clips.empty()) throw Error("corpus", "has no clips", "Give some");
  for (std::size_t k = 0; k < corpus.clips.size(); ++k) {
    Group& group = corpus.clips[k].made ? made_ : captured_;
    const long before = group.end.empty() ? 0 : group.end.back();
    group.clips.push_back(static_cast<int>(k));
    group.end.push_back(before + static_cast<long>(corpus.clips[k].poses.size()));
  }
}

GoalPlan WindowSampler::DrawGoals(const CorpusClip& clip, int frame,
                                  nn::RandomStream& random) const {
  const double kind = random.Uniform(), when = random.Uniform(), error = random.Uniform();
  GoalPlan plan;
  if (kind < mixture_.none) return plan;
  const auto next = std::find_if(clip.goals.begin(), clip.goals.end(),
                                 [&](const Waypoint& goal) { return goal.frame > frame; });
  if (next == clip.goals.end() || kind < mixture_.none + mixture_.hindsight) {
    const int last = std::min(frame + kLatest, static_cast<int>(clip.poses.size()) - 1);
    const int first = std::min(frame + kSoonest, last);
    if (last <= frame) return plan;
    const int goal = first + static_cast<int>(when * (last - first + 1));
    const Vector3<float> wrist = WristPosition(bones_, clip.poses[goal], wrist_);
    plan.push_back({wrist.cast<double>(), goal - frame});
    return plan;
  }
  for (auto goal = next; goal != clip.goals.end(); ++goal) {
    plan.push_back({goal->position, goal->frame - frame});
  }
  const double spare = plan.front().frame - kSureWithin;
  if (spare > 0.0) {
    const int shift =
        static_cast<int>(std::lround(spare * mixture_.deadline_error * (2.0 * error - 1.0)));
    plan.front().frame += shift;
    if (plan.size() > 1) plan.front().frame = std::min(plan.front().frame, plan[1].frame - 1);
  }
  return plan;
}

TangentVector<float> WindowSampler::DrawPerturbation(nn::RandomStream& random) const {
  const double deviation = mixture_.perturbation_rad * random.Uniform();
  TangentVector<float> perturbation;
  double pair[2] = {};
  for (int i = 0; i < kTangentSize; ++i) {
    if (i % 2 == 0) random.NormalPair(pair[0], pair[1]);
    perturbation[i] = static_cast<float>(deviation * pair[i % 2]);
  }
  perturbation.head<3>() *= kHeightPerAngle;
  for (const int k : kLegs) perturbation.segment<3>(TangentOf(k)) *= 0.5f;
  return perturbation;
}

TrainingWindow WindowSampler::Draw(int steps, nn::RandomStream& random) const {
  const double source = random.Uniform();
  const bool captured =
      made_.clips.empty() || (!captured_.clips.empty() && source < mixture_.captured);
  const Group& group = captured ? captured_ : made_;
  for (;;) {
    const long drawn = static_cast<long>(random.Uniform() * static_cast<double>(group.end.back()));
    const auto at = std::upper_bound(group.end.begin(), group.end.end(), drawn) - group.end.begin();
    const CorpusClip& clip = corpus_.clips[group.clips[at]];
    const int frames = static_cast<int>(clip.poses.size());
    if (frames < steps + 2) continue;
    const int frame = static_cast<int>(random.Uniform() * (frames - steps));
    TrainingWindow window;
    window.truth = clip.poses.data() + frame;
    if (frame > 0) window.before = window.truth - 1;
    window.plan = DrawGoals(clip, frame, random);
    if (random.Uniform() < mixture_.perturbed) window.perturbation = DrawPerturbation(random);
    return window;
  }
}

}  // namespace holdfast::wandr
