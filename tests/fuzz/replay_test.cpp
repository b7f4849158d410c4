// SPDX-License-Identifier: MIT
// Reads all inputs kept for the fuzzers: seeds (corpus/, and the fixtures of a format's own tests)
// and what once broke a reader (regressions/).
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace holdfast::fuzz {

static void PrintTo(const FuzzTarget& target, std::ostream* out) { *out << target.name; }

namespace {

namespace fs = std::filesystem;

// Readers promise 2 s for a malformed file. Sanitizers take several times as long.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kMaxReplaySeconds = 20;
#else
constexpr double kMaxReplaySeconds = 2;
#endif

std::vector<fs::path> InputsOf(const FuzzTarget& target) {
  std::vector<fs::path> files;
  for (const char* kind : {"fuzz/corpus", "fuzz/regressions", "fixtures"}) {
    const fs::path folder = fs::path(HOLDFAST_SOURCE_DIR) / "tests" / kind / target.name;
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

Outcome RunBytes(const FuzzTarget& target, const std::string& bytes) {
  return Run(target, std::as_bytes(std::span(bytes)));
}

class Replay : public testing::TestWithParam<FuzzTarget> {};

TEST_P(Replay, ReadsOrRefusesEveryInputInTimeAndMemory) {
  int accepted = 0;
  int refused = 0;
  for (const fs::path& file : InputsOf(GetParam())) {
    SCOPED_TRACE(file.filename());
    const std::string bytes = ReadFile(file);
    Outcome outcome;
    ASSERT_NO_THROW(outcome = RunBytes(GetParam(), bytes));
    EXPECT_LT(outcome.seconds, kMaxReplaySeconds);
    (outcome.accepted ? accepted : refused)++;
  }
  EXPECT_GT(accepted, 0) << "no input of the corpus reaches the end of the reader";
  EXPECT_GT(refused, 0);
}

TEST_P(Replay, ReadsOrRefusesEveryInputCutShort) {
  for (const fs::path& file : InputsOf(GetParam())) {
    SCOPED_TRACE(file.filename());
    const std::string bytes = ReadFile(file);
    for (std::size_t part = 0; part < 12; ++part) {
      ASSERT_NO_THROW(RunBytes(GetParam(), bytes.substr(0, bytes.size() * part / 12)));
    }
  }
}

TEST_P(Replay, ReadsOrRefusesEveryInputWithWrongBytes) {
  std::minstd_rand random(7);
  for (const fs::path& file : InputsOf(GetParam())) {
    SCOPED_TRACE(file.filename());
    const std::string bytes = ReadFile(file);
    if (bytes.empty()) continue;
    for (int trial = 0; trial < 12; ++trial) {
      std::string wrong = bytes;
      for (int k = 0; k <= trial / 3; ++k) {
        wrong[random() % wrong.size()] = static_cast<char>(random() >> 8);
      }
      ASSERT_NO_THROW(RunBytes(GetParam(), wrong));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, Replay, testing::ValuesIn(Targets()),
                         [](const auto& target) { return std::string(target.param.name); });

// Memory that no compiler proves to be needless.
void* Allocated(std::size_t bytes) {
  void* volatile block = std::malloc(bytes);
  return block;
}

// What stands for a reader that does not keep its promises must be noticed.

TEST(FuzzHarness, NoticesMemoryOutOfProportion) {
  const FuzzTarget greedy{"greedy", [](Trial& trial) {
                            std::free(Allocated(std::size_t{65} << 20));
                            trial.Accept();
                          }};
  EXPECT_THROW(RunBytes(greedy, "a few bytes"), BrokenPromise);
  EXPECT_NO_THROW(RunBytes(greedy, std::string(std::size_t{1} << 20, ' ')));
}

TEST(FuzzHarness, NoticesMemoryOfARefusalToo) {
  const FuzzTarget greedy{"greedy", [](Trial&) {
                            std::free(Allocated(std::size_t{80} << 20));
                            throw Error("file", "refused", "late");
                          }};
  EXPECT_THROW(RunBytes(greedy, ""), BrokenPromise);
}

TEST(FuzzHarness, CountsWhatCLibrariesAllocate) {
  const FuzzTarget calls{"calls", [](Trial& trial) {
                           void* volatile block = std::calloc(1000, 1000);
                           block = std::realloc(block, 3'000'000);
                           std::free(block);
                           trial.Accept();
                         }};
  const std::size_t peak = RunBytes(calls, "").peak_bytes;
  EXPECT_GE(peak, 3'000'000u);
  EXPECT_LT(peak, 4'200'000u);
}

TEST(FuzzHarness, LetsOnlyErrorsPassAndOnlyBeforeAccepting) {
  const FuzzTarget refuses{"refuses", [](Trial&) { throw Error("file", "is bad", "mend it"); }};
  EXPECT_EQ(RunBytes(refuses, "").refusal, "file: is bad. mend it");
  const FuzzTarget fails{"fails", [](Trial&) { throw std::bad_alloc(); }};
  EXPECT_THROW(RunBytes(fails, ""), std::bad_alloc);
  const FuzzTarget regrets{"regrets", [](Trial& trial) {
                             trial.Accept();
                             throw Error("file", "is bad", "mend it");
                           }};
  EXPECT_THROW(RunBytes(regrets, ""), BrokenPromise);
  const FuzzTarget forgets{"forgets", [](Trial&) {}};
  EXPECT_THROW(RunBytes(forgets, ""), BrokenPromise);
}

}  // namespace
}  // namespace holdfast::fuzz
