// SPDX-License-Identifier: MIT
#include "solver/evaluation/synthesis/synthesis_results.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "generator/nn/random_stream.h"
#include "generator/walk_statistics/sample_statistics.h"

namespace holdfast {
namespace {

constexpr const char* kObjectKeys[] = {
    "deep_penetration_frames_ratio", "penetration_max_mm",
    "penetration_mean_max_mm",       "contact_frames_ratio",
    "contact_slip_mm_per_frame",     "contact_drift_mm",
    "jitter_acceleration_ratio",     "jitter_angular_acceleration_ratio",
    "object_acceleration_m_s2",      "joint_acceleration_m_s2",
    "foot_skate_mm_per_frame"};

std::vector<int> LabelsOf(std::span<const SynthesisCase> cases) {
  std::vector<int> labels;
  for (const SynthesisCase& one : cases) labels.push_back(one.sequence.action);
  return labels;
}

// Two random halves of a set against each other.
double DistanceOfHalves(const Eigen::MatrixXf& features, std::uint64_t seed) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(features.cols()));
  std::iota(order.begin(), order.end(), 0);
  nn::RandomStream random(seed, 1);
  for (std::size_t n = order.size(); n-- > 1;) {
    std::swap(order[n],
              order[static_cast<std::size_t>(random.Uniform() * static_cast<double>(n + 1))]);
  }
  const std::size_t half = order.size() / 2;
  const std::vector<Eigen::Index> a(order.begin(), order.begin() + half);
  const std::vector<Eigen::Index> b(order.begin() + half, order.begin() + 2 * half);
  return imos::FrechetDistance(features(Eigen::all, a), features(Eigen::all, b));
}

template <typename Measure>
imos::RepeatedValue Repeat(int repeats, const Measure& measure) {
  std::vector<double> values;
  for (int r = 0; r < repeats; ++r) values.push_back(measure(r));
  return imos::OverRepeats(values);
}

std::vector<ActionAccuracy> ByAction(std::span<const SynthesisSample> samples,
                                     const std::vector<int>& labels) {
  std::map<int, std::pair<int, int>> counts;  // right, all
  for (const SynthesisSample& sample : samples) {
    for (std::size_t n = 0; n < labels.size(); ++n) {
      counts[labels[n]].first += sample.recognized[n] == labels[n];
      ++counts[labels[n]].second;
    }
  }
  std::vector<ActionAccuracy> all;
  for (const auto& [action, count] : counts) {
    all.push_back({std::string(imos::Actions()[action].label),
                   count.second / static_cast<int>(samples.size()),
                   static_cast<double>(count.first) / count.second});
  }
  return all;
}

std::vector<double> Defined(const Eigen::Ref<const Eigen::RowVectorXd>& values) {
  std::vector<double> defined;
  for (const double value : values) {
    if (std::isfinite(value)) defined.push_back(value);
  }
  return defined;
}

nlohmann::json Json(const imos::RepeatedValue& value) {
  return {{"mean", value.mean}, {"interval_95", value.interval}, {"repeats", value.repeats}};
}
nlohmann::json Json(const std::optional<imos::RepeatedValue>& value) {
  return value ? Json(*value) : nlohmann::json(nullptr);
}
nlohmann::json Json(const PaperValue& value) {
  return {{"mean", value.mean}, {"interval_95", value.interval}};
}

}  // namespace

std::span<const char* const> SynthesisObjectKeys() { return kObjectKeys; }

void SynthesisSample::Append(const SynthesisSample& more) {
  if (recognized.empty()) {
    *this = more;
    return;
  }
  const auto join = [](auto& to, const auto& from) {
    const Eigen::Index before = to.cols();
    to.conservativeResize(to.rows(), before + from.cols());
    to.rightCols(from.cols()) = from;
  };
  join(features, more.features);
  join(errors, more.errors);
  join(seconds, more.seconds);
  join(objects, more.objects);
  recognized.insert(recognized.end(), more.recognized.begin(), more.recognized.end());
}

SynthesisSummary SummarizeSynthesis(const SynthesisRow& row,
                                    std::span<const SynthesisSample> samples,
                                    const SynthesisSample& real,
                                    std::span<const SynthesisCase> cases, int repeats,
                                    std::uint64_t seed) {
  const std::vector<int> labels = LabelsOf(cases);
  const int made = static_cast<int>(samples.size());
  const auto of = [&](int repeat) -> const SynthesisSample& {
    return samples[static_cast<std::size_t>(std::min(repeat, made - 1))];
  };
  const auto draw = [&](int repeat) {
    return seed * 1'000'003 + static_cast<std::uint64_t>(repeat);
  };
  const bool enough = labels.size() >= 4;

  SynthesisSummary summary;
  summary.sequences = static_cast<int>(labels.size());
  summary.by_action = ByAction(samples, labels);
  summary.accuracy =
      Repeat(made, [&](int r) { return imos::RecognitionAccuracy(of(r).recognized, labels); });
  // Of rows without chance only the draws of pairs are repeated.
  const int draws = row.IsRandom() ? made : repeats;
  summary.diversity_code =
      Repeat(draws, [&](int r) { return imos::DiversityOfCode(of(r).features, draw(r)); });
  summary.multimodality_code = Repeat(draws, [&](int r) {
    return imos::MultimodalityOfCode(of(r).features, of(r).recognized, imos::kNumActions, draw(r));
  });
  if (enough) {
    summary.diversity = Repeat(made, [&](int r) { return imos::Diversity(of(r).features); });
    if (imos::Multimodality(real.features, labels)) {
      summary.multimodality =
          Repeat(made, [&](int r) { return *imos::Multimodality(of(r).features, labels); });
    }
    if (row.kind == RowKind::kReal) {
      summary.fid =
          Repeat(repeats, [&](int r) { return DistanceOfHalves(real.features, draw(r)); });
    } else {
      summary.fid =
          Repeat(made, [&](int r) { return imos::FrechetDistance(of(r).features, real.features); });
    }
  }
  if (row.HasMotionErrors()) {
    const auto error = [&](int which) {
      return Repeat(made, [&](int r) { return of(r).errors.row(which).mean(); });
    };
    summary.mpjpe_m = error(0);
    summary.ave_code = error(1);
    summary.ave_m2 = error(2);
    // Given objects come to faces by themselves. Which sequences bring theirs is the reference's.
    const bool brings = row.kind == RowKind::kStill || row.mode != ObjectMode::kGiven;
    if (brings && !Defined(of(0).errors.row(3)).empty()) {
      summary.face_m = Repeat(made, [&](int r) { return MeanOf(Defined(of(r).errors.row(3))); });
    }
    summary.fid_code = Repeat(
        made, [&](int r) { return imos::FrechetDistanceOfCode(of(r).features, real.features); });
  }
  const std::span<const char* const> keys = SynthesisObjectKeys();
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const std::string key = keys[k];
    const std::vector<double> values =
        Defined(samples[0].objects.row(static_cast<Eigen::Index>(k)));
    std::optional<double>& value = summary.objects[key];
    if (values.empty()) continue;
    value = key.starts_with("jitter_") ? QuantileOf(values, 0.5) : MeanOf(values);
  }
  const auto median = [&](int which) {
    std::vector<double> taken = Defined(samples[0].seconds.row(which));
    std::erase(taken, 0.0);  // of what was not made
    return taken.empty() ? 0.0 : QuantileOf(taken, 0.5);
  };
  summary.seconds = median(0);
  summary.finishing_seconds = median(1);
  return summary;
}

void AddMeansOverSeeds(std::vector<SynthesisResult>& results) {
  std::map<std::pair<ObjectMode, std::string>, std::vector<const SynthesisSummary*>> seeds;
  std::vector<std::pair<ObjectMode, std::string>> order;
  for (const SynthesisResult& result : results) {
    if (result.row.kind != RowKind::kNetwork) continue;
    const std::pair key(result.row.mode, result.row.Name());
    if (!seeds.contains(key)) order.push_back(key);
    seeds[key].push_back(&result.summary);
  }
  std::vector<SynthesisResult> means;
  for (const auto& key : order) {
    const std::vector<const SynthesisSummary*>& all = seeds[key];
    if (all.size() < 2) continue;
    const auto over = [&](const auto& value) {
      std::vector<double> values;
      for (const SynthesisSummary* one : all) values.push_back(value(*one));
      return imos::OverRepeats(values);
    };
    SynthesisResult mean;
    mean.row.key = key.second;
    mean.row.label = fmt::format("{}, mean of {} seeds", LabelOfNetwork(key.second), all.size());
    mean.row.kind = RowKind::kMean;
    mean.row.mode = key.first;
    SynthesisSummary& s = mean.summary;
    s.sequences = all[0]->sequences;
    using Measure = imos::RepeatedValue SynthesisSummary::*;
    for (const Measure m : {&SynthesisSummary::accuracy, &SynthesisSummary::diversity_code,
                            &SynthesisSummary::diversity, &SynthesisSummary::multimodality_code}) {
      s.*m = over([m](const SynthesisSummary& one) { return (one.*m).mean; });
    }
    using Optional = std::optional<imos::RepeatedValue> SynthesisSummary::*;
    for (const Optional m :
         {&SynthesisSummary::mpjpe_m, &SynthesisSummary::ave_code, &SynthesisSummary::ave_m2,
          &SynthesisSummary::fid_code, &SynthesisSummary::fid, &SynthesisSummary::face_m,
          &SynthesisSummary::multimodality}) {
      if (all[0]->*m) s.*m = over([m](const SynthesisSummary& one) { return (one.*m)->mean; });
    }
    for (std::size_t a = 0; a < all[0]->by_action.size(); ++a) {
      s.by_action.push_back(all[0]->by_action[a]);
      s.by_action.back().accuracy =
          over([a](const SynthesisSummary& one) { return one.by_action[a].accuracy; }).mean;
    }
    means.push_back(std::move(mean));
  }
  results.insert(results.end(), means.begin(), means.end());
}

nlohmann::json SynthesisJson(const SynthesisResult& result) {
  const auto& [row, s] = result;
  nlohmann::json json = {{"row", row.key}, {"label", row.label}, {"sequences", s.sequences}};
  if (row.network || row.kind == RowKind::kMean) json["objects_placed"] = ObjectModeName(row.mode);
  if (row.kind == RowKind::kMean) json["mean_of_seeds"] = true;
  if (row.network) {
    json["network"] = row.network->loaded.ToJson();
    json["config"] = imos::ConfigTexts(row.network->loaded.weights.config);
    json["seconds_median"] = s.seconds;
    json["finishing_seconds_median"] = s.finishing_seconds;
  }
  if (row.kind != RowKind::kClip) {
    json["as_published"] = {{"mpjpe_m", Json(s.mpjpe_m)},
                            {"ave", Json(s.ave_code)},
                            {"fid", Json(s.fid_code)},
                            {"accuracy_ratio", Json(s.accuracy)},
                            {"diversity", Json(s.diversity_code)},
                            {"multimodality", Json(s.multimodality_code)}};
    json["as_defined"] = {{"mpjpe_m", Json(s.mpjpe_m)},
                          {"ave_m2", Json(s.ave_m2)},
                          {"fid", Json(s.fid)},
                          {"face_m", Json(s.face_m)},
                          {"accuracy_ratio", Json(s.accuracy)},
                          {"diversity", Json(s.diversity)},
                          {"multimodality", Json(s.multimodality)}};
    for (const ActionAccuracy& one : s.by_action) {
      json["by_action"][one.action] = {{"sequences", one.sequences},
                                       {"accuracy_ratio", one.accuracy}};
    }
  }
  for (const auto& [key, value] : s.objects) {
    json["objects"][key] = value ? nlohmann::json(*value) : nlohmann::json(nullptr);
  }
  return json;
}

nlohmann::json PaperSynthesisJson() {
  nlohmann::json rows;
  for (const PaperSynthesisRow& row : PaperSynthesisRows()) {
    nlohmann::json json = {{"label", row.label},
                           {"accuracy_ratio", Json(row.accuracy)},
                           {"diversity", Json(row.diversity)},
                           {"multimodality", Json(row.multimodality)}};
    if (row.mpjpe) {
      json["mpjpe_m"] = Json(*row.mpjpe);
      json["ave"] = Json(*row.ave);
      json["fid"] = Json(*row.fid);
    }
    rows.push_back(std::move(json));
  }
  return rows;
}

std::vector<std::string> OrderOfRows(std::span<const SynthesisResult> results, ObjectMode mode) {
  const SynthesisSummary* full = nullptr;
  std::vector<const SynthesisResult*> others;
  std::set<std::string> with_mean;
  for (const SynthesisResult& result : results) {
    if (result.row.kind == RowKind::kMean) with_mean.insert(result.row.key);
  }
  for (const SynthesisResult& result : results) {
    const bool alone =
        result.row.kind == RowKind::kNetwork && !with_mean.contains(result.row.Name());
    if ((!alone && result.row.kind != RowKind::kMean) || result.row.mode != mode) continue;
    if (result.row.Name() == "full") {
      full = &result.summary;
    } else {
      others.push_back(&result);
    }
  }
  std::vector<std::string> sentences;
  if (!full || others.empty()) return sentences;
  struct Column {
    const char* name;
    std::optional<imos::RepeatedValue> (*of)(const SynthesisSummary&);
    double sign;  // +1: smaller is better
  };
  using S = SynthesisSummary;
  using V = std::optional<imos::RepeatedValue>;
  constexpr Column kColumns[] = {{"MPJPE", [](const S& s) { return s.mpjpe_m; }, 1.0},
                                 {"AVE (code)", [](const S& s) { return s.ave_code; }, 1.0},
                                 {"AVE", [](const S& s) { return s.ave_m2; }, 1.0},
                                 {"FID (code)", [](const S& s) { return s.fid_code; }, 1.0},
                                 {"FID", [](const S& s) { return s.fid; }, 1.0},
                                 {"accuracy", [](const S& s) -> V { return s.accuracy; }, -1.0},
                                 {"object at the face", [](const S& s) { return s.face_m; }, 1.0}};
  for (const Column& column : kColumns) {
    const V best = column.of(*full);
    if (!best) continue;
    std::vector<std::string> better, even;
    for (const SynthesisResult* other : others) {
      const V value = column.of(other->summary);
      if (!value) continue;
      // By how much the full model is ahead, against what both means are known to.
      const double ahead = column.sign * (value->mean - best->mean);
      const double known = std::hypot(value->interval, best->interval);
      if (ahead < -known) {
        better.push_back(other->row.label);
      } else if (ahead <= known) {
        even.push_back(other->row.label);
      }
    }
    std::string text = fmt::format("{}: ", column.name);
    if (better.empty() && even.empty()) {
      text += "the full model is ahead of every ablation";
    } else {
      if (!better.empty()) text += fmt::format("BEHIND {}", fmt::join(better, ", "));
      if (!better.empty() && !even.empty()) text += "; ";
      if (!even.empty()) text += fmt::format("even with {}", fmt::join(even, ", "));
    }
    sentences.push_back(text);
  }
  return sentences;
}

}  // namespace holdfast
