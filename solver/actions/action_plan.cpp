// SPDX-License-Identifier: MIT
#include "solver/actions/action_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/actions/action_catalog.h"
#include "generator/imos/vocabulary.h"
#include "generator/nn/random_stream.h"
#include "geometry/error.h"
#include "geometry/seed.h"

namespace holdfast {
namespace {

constexpr std::uint64_t kShapes = 0x5EED, kDraws = 0xD0;

// The requested actions, with their requested objects.
std::vector<ScriptedAction> ChoicesOf(const ActionSetOptions& options) {
  const auto asked = [](const std::vector<std::string>& list, std::string_view name) {
    return list.empty() || std::ranges::find(list, name) != list.end();
  };
  std::vector<ScriptedAction> choices;
  std::vector<std::string_view> known;
  for (ScriptedAction action : ScriptedActions()) {
    if (!asked(options.actions, action.name)) continue;
    for (const std::string_view object : action.objects) {
      if (std::ranges::find(known, object) == known.end()) known.push_back(object);
    }
    std::erase_if(action.objects,
                  [&](std::string_view object) { return !asked(options.objects, object); });
    if (!action.objects.empty()) choices.push_back(std::move(action));
  }
  for (const std::string& object : options.objects) {
    if (std::ranges::find(known, object) != known.end()) continue;
    throw Error(object, "is not an object of these actions",
                fmt::format("Their objects are {}", fmt::join(known, ", ")));
  }
  return choices;
}

// Whether a subject is left-handed: evenly spread, including the last subject if there are any.
bool IsLeftHanded(int subject, double share) {
  return std::floor((subject + 1) * share + 1e-9) > std::floor(subject * share + 1e-9);
}

}  // namespace

bool IsHeldOut(int subject, int subjects) {
  return subject >= subjects - std::max(1, subjects / 5);
}

Eigen::VectorXd SubjectBetas(int subject, int count, std::uint64_t seed) {
  RandomDraws draws(MixSeed(MixSeed(seed, kShapes), static_cast<std::uint64_t>(subject)));
  Eigen::VectorXd betas(count);
  for (int k = 0; k < count; ++k) betas(k) = std::clamp(0.9 * draws.Normal(), -2.0, 2.0);
  return betas.cast<float>().cast<double>();
}

std::vector<ActionJob> PlanActions(const ActionSetOptions& options) {
  for (const std::string& action : options.actions) FindScriptedAction(action);
  const std::vector<ScriptedAction> choices = ChoicesOf(options);
  double total = 0.0;
  for (const ScriptedAction& choice : choices) total += choice.share;
  std::vector<double> made(choices.size(), 0.0);
  std::vector<int> turns(choices.size(), 0);
  std::map<std::string, int> numbers;
  std::vector<ActionJob> jobs;
  for (int index = 0; index < options.count; ++index) {
    // The action that is furthest behind its share.
    std::size_t next = 0;
    for (std::size_t k = 0; k < choices.size(); ++k) {
      if (made[k] / choices[k].share < made[next] / choices[next].share) next = k;
    }
    made[next] += 1.0;
    const ScriptedAction& choice = choices[next];
    ActionJob job;
    job.index = index;
    job.seed = MixSeed(options.seed, static_cast<std::uint64_t>(index));
    RandomDraws draws(MixSeed(job.seed, kDraws));
    job.action = choice.name;
    // Separate counter per action, so that subjects and actions do not become correlated.
    job.subject = (turns[next]++ + static_cast<int>(next)) % options.subjects;
    const double u = draws.Uniform(0.0, 1.0);
    const auto objects = static_cast<double>(choice.objects.size());
    std::size_t object = std::min(choice.objects.size() - 1,
                                  static_cast<std::size_t>((0.4 * u + 0.6 * u * u) * objects));
    if (choice.name == "offhand") {
      object = (static_cast<std::size_t>(job.subject) + (u < 0.5 ? 0 : 1)) % choice.objects.size();
    }
    job.object = choice.objects[object];
    job.left = IsLeftHanded(job.subject, options.left_share);
    const std::string stem =
        fmt::format("s{}/{}_{}", job.subject + 1, imos::VocabularyName(job.object), job.action);
    job.name = fmt::format("{}_{}", stem, ++numbers[stem]);
    jobs.push_back(std::move(job));
  }
  return jobs;
}

std::vector<CapturedJob> PlanCaptured(const ActionSetOptions& options) {
  if (options.captured.empty()) return {};
  const std::vector<MarkerTrialFiles> trials = FindMarkerTrials(options.captured);
  std::vector<std::string> people;  // sorted, as are the trials
  for (const MarkerTrialFiles& trial : trials) {
    if (people.empty() || people.back() != trial.Person()) people.push_back(trial.Person());
  }
  int learning = 0;
  while (learning < options.subjects && !IsHeldOut(learning, options.subjects)) ++learning;
  std::vector<CapturedJob> jobs;
  std::array<int, 2> turns = {};
  for (const MarkerTrialFiles& trial : trials) {
    const auto person =
        static_cast<int>(std::ranges::find(people, trial.Person()) - people.begin());
    const auto count = static_cast<int>(people.size());
    const bool held_out = count > 1 && IsHeldOut(person, count);
    for (const RestPosture posture : {RestPosture::kSeated, RestPosture::kStanding}) {
      const int turn = turns[held_out ? 1 : 0]++;
      CapturedJob job;
      job.index = kMaxScripted + static_cast<int>(jobs.size());
      job.files = trial;
      job.posture = posture;
      job.held_out = held_out;
      job.subject = held_out ? learning + turn % (options.subjects - learning) : turn % learning;
      job.seed = MixSeed(options.seed, static_cast<std::uint64_t>(job.index));
      jobs.push_back(std::move(job));
    }
  }
  return jobs;
}

}  // namespace holdfast
