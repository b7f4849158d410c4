// SPDX-License-Identifier: MIT
#include "generator/training/training_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/io/container/atomic_file.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;

// Counts; its checkpoint is the count.
class Counter : public IterativeTrainer {
 public:
  long Iteration() const override { return count; }
  long NumParameters() const override { return 1; }
  void Save(const std::filesystem::path& path) const override {
    WriteAtomically(path, std::to_string(count));
  }
  void Load(const std::filesystem::path& path) override { count = std::stol(ReadFile(path)); }
  long count = 0;
};

class TrainingRun : public ::testing::Test {
 protected:
  TrainingRun() {
    training_.step = [&](json& losses, json& line) {
      ++counter_.count;
      line["kind"] = counter_.count % 2 == 0 ? "train" : "free";
      losses["total"] = static_cast<double>(counter_.count);
    };
    training_.evaluate = [&] { return json{{"error", std::abs(counter_.count - 20)}}; };
    training_.is_better = [](const json& now, const json& best) {
      return now["error"] <= best["error"];
    };
    training_.write = [&](const TrainingNotes& notes, const std::string& stem) {
      written_[std::filesystem::path(stem).filename().string()].push_back(notes.at("iteration"));
      EXPECT_EQ(notes.at("of"), "counting");
    };
    options_.folder = folder_.Path();
    options_.evaluate_every = 10;
    options_.notes["of"] = "counting";
    watch_.log = [&](const std::vector<json>& lines) { options_.lines = lines; };
  }

  testing::TemporaryFolder folder_;
  Counter counter_;
  Training training_{counter_, 60, "error", {}, {}, {}, {}};
  RunOptions options_;
  RunWatch watch_;
  std::map<std::string, std::vector<std::string>> written_;
};

TEST_F(TrainingRun, KeepsTheBestAndTheLatest) {
  const json best = RunTraining(training_, options_, watch_);
  EXPECT_EQ(best, json({{"kind", "error"}, {"iteration", 20}, {"error", 0}}));
  EXPECT_THAT(written_["best"], ElementsAre("10", "20"));
  EXPECT_THAT(written_["latest"], ElementsAre("10", "20", "30", "40", "50", "60"));
  EXPECT_EQ(ReadFile(folder_ / "checkpoint.safetensors"), "60");
}

TEST_F(TrainingRun, WritesMeansSinceTheLastLine) {
  RunTraining(training_, options_, watch_);
  std::vector<std::pair<std::string, double>> means;
  for (const json& line : options_.lines) {
    if (line["kind"] != "error") means.emplace_back(line["kind"], line["total"]);
  }
  EXPECT_THAT(means, ElementsAre(std::pair("train", 26.0), std::pair("free", 25.0),
                                 std::pair("train", 56.0), std::pair("free", 55.0)));
}

TEST_F(TrainingRun, EndsWithoutImprovementAndGoesOn) {
  options_.patience = 20;
  RunTraining(training_, options_, watch_);
  EXPECT_EQ(counter_.count, 40);
  counter_.count = 0;
  counter_.Load(folder_ / "checkpoint.safetensors");
  options_.patience = 0;
  EXPECT_EQ(RunTraining(training_, options_, watch_)["iteration"], 20)
      << "of an earlier run's line";
  EXPECT_EQ(counter_.count, 60);
}

TEST_F(TrainingRun, StopsWhenAsked) {
  int seen = 0, of = 0;
  watch_.progress = [&](int done, int total) { seen = done, of = total; };
  watch_.stop = [&] { return seen == 7; };
  EXPECT_TRUE(RunTraining(training_, options_, watch_).is_null());
  EXPECT_EQ(ReadFile(folder_ / "checkpoint.safetensors"), "7");
  EXPECT_EQ(of, 60);
}

}  // namespace
}  // namespace holdfast
