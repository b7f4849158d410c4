// SPDX-License-Identifier: MIT
#include "geometry/jobs/run_jobs.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/jobs/job_journal.h"
#include "geometry/jobs/job_list.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;
using testing::TemporaryFolder;

// Jobs that write their number; those in `failing` fail.
struct TinyJobs {
  fs::path folder;
  int count = 20;
  std::string asked = "a";
  int failing = -1;
  double seconds = 0.0;
  std::atomic<int> runs{0};

  std::vector<Job> List() const {
    std::vector<Job> jobs;
    for (int k = 0; k < count; ++k) {
      const std::string name = fmt::format("job {} ü", k);
      jobs.push_back(
          {name, folder / name, {"word"}, [this, k] { return fmt::format("{}{}", asked, k); }});
    }
    return jobs;
  }

  JobsReport Run(JobsOptions options = {}) {
    options.folder = folder;
    options.kind = "tiny";
    const std::vector<Job> jobs = List();
    return RunJobs(
        jobs, options,
        [&](std::size_t k) -> std::optional<JobOutcome> {
          ++runs;
          std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
          if (static_cast<int>(k) == failing) return JobOutcome{false, 1, "no such thing", {}};
          WriteAtomically(jobs[k].result, fmt::format("{} {}", asked, k));
          return JobOutcome{true, 0, "", {{"value", k}}};
        },
        nullptr, nullptr);
  }
};

JobsOptions Shard(int index, int count) {
  JobsOptions options;
  options.shard = index;
  options.shards = count;
  return options;
}

// What a folder holds but for .jobs: bytes that depend on no time.
std::map<std::string, std::string> Bytes(const fs::path& folder) {
  std::map<std::string, std::string> bytes;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name != kJobsFolder) bytes[name] = ReadFile(entry.path());
  }
  return bytes;
}

template <typename Body>
pid_t InProcess(const Body& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    body();
    ::_exit(0);
  }
  return child;
}

TEST(RunJobs, RunsEachOnceAndFindsThemDone) {
  const TemporaryFolder folder;
  TinyJobs jobs{folder / "out"};
  jobs.failing = 3;
  const JobsReport first = jobs.Run();
  EXPECT_EQ(first.jobs, 20);
  EXPECT_EQ(first.failed, 1);
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_EQ(jobs.runs, 20);
  const JobsReport again = jobs.Run();
  EXPECT_EQ(again.before, 20);
  EXPECT_EQ(again.exit_code, 1) << "a failure stays one";
  EXPECT_EQ(jobs.runs, 20);
  jobs.failing = -1;
  JobsOptions retry;
  retry.retry_failed = true;
  EXPECT_EQ(jobs.Run(retry).failed, 0);
  EXPECT_EQ(jobs.runs, 21);
  const nlohmann::json manifest = ReadJson(folder / "out/manifest.json");
  EXPECT_EQ(manifest["jobs"].size(), 20u);
  EXPECT_EQ(manifest["failed"], 0);
  EXPECT_EQ(manifest["jobs"][3]["summary"]["value"], 3);
}

TEST(RunJobs, AListGrowsAndAResultThatIsGoneIsMadeAgain) {
  const TemporaryFolder folder;
  TinyJobs jobs{folder / "out"};
  jobs.Run();
  fs::remove(folder / "out/job 4 ü");
  jobs.count = 25;
  EXPECT_EQ(jobs.Run().before, 19);
  EXPECT_EQ(jobs.runs, 26);
}

TEST(RunJobs, ShardsMakeTheWholeOnceAllAreThere) {
  const TemporaryFolder folder;
  TinyJobs whole{folder / "whole"}, parts{folder / "parts"};
  whole.Run();
  EXPECT_EQ(parts.Run(Shard(2, 3)).jobs, 7);
  EXPECT_FALSE(fs::exists(folder / "parts/manifest.json"));
  EXPECT_EQ(parts.Run(Shard(1, 3)).unfinished, 6);
  EXPECT_EQ(parts.Run(Shard(3, 3)).unfinished, 0);
  EXPECT_EQ(Bytes(folder / "whole"), Bytes(folder / "parts"));
  for (const auto& [index, count] : {std::pair{0, 3}, {4, 3}, {1, 0}, {-1, 3}}) {
    EXPECT_THROW(parts.Run(Shard(index, count)), Error) << index << '/' << count;
  }
}

TEST(RunJobs, RefusesOtherQuestionsAndOtherFolders) {
  const TemporaryFolder folder;
  TinyJobs jobs{folder / "out"};
  jobs.Run();
  jobs.asked = "b";
  EXPECT_THROW(jobs.Run(), Error);
  JobsOptions replace;
  replace.replace = true;
  EXPECT_EQ(jobs.Run(replace).before, 0);
  EXPECT_EQ(ReadFile(folder / "out/job 0 ü"), "b 0");
  fs::create_directories(folder / "foreign");
  WriteAtomically(folder / "foreign/diary.txt", "mine");
  TinyJobs foreign{folder / "foreign"};
  EXPECT_THROW(foreign.Run(), Error);
  EXPECT_EQ(foreign.runs, 0);
}

TEST(RunJobs, TwoProcessesShareAFolderAndDoNothingTwice) {
  const TemporaryFolder folder;
  TinyJobs whole{folder / "whole"};
  whole.count = 60;
  whole.Run();
  std::vector<pid_t> children;
  for (int process = 0; process < 3; ++process) {
    children.push_back(InProcess([&] {
      TinyJobs jobs{folder / "shared"};
      jobs.count = 60;
      jobs.seconds = 1e-3;
      jobs.Run();
      std::ofstream(folder / fmt::format("runs{}", process)) << jobs.runs;
    }));
  }
  int runs = 0;
  for (std::size_t process = 0; process < children.size(); ++process) {
    int status = 0;
    ::waitpid(children[process], &status, 0);
    ASSERT_EQ(status, 0);
    runs += std::stoi(ReadFile(folder / fmt::format("runs{}", process)));
  }
  EXPECT_EQ(runs, 60);
  EXPECT_EQ(Bytes(folder / "whole"), Bytes(folder / "shared"));
}

TEST(RunJobs, KilledAtAnyMomentEndsWithTheSameBytes) {
  const TemporaryFolder folder;
  TinyJobs whole{folder / "whole"};
  whole.count = 40;
  whole.Run();
  std::mt19937 random(7);
  for (int kill = 0; kill < 12; ++kill) {
    const pid_t child = InProcess([&] {
      TinyJobs jobs{folder / "killed"};
      jobs.count = 40;
      jobs.seconds = 1e-3;
      JobsOptions options;
      options.threads = 2;
      jobs.Run(options);
    });
    std::this_thread::sleep_for(std::chrono::microseconds(500 + random() % 6000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  TinyJobs last{folder / "killed"};
  last.count = 40;
  last.Run();
  EXPECT_EQ(Bytes(folder / "whole"), Bytes(folder / "killed"));
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "killed/.jobs")) {
    EXPECT_FALSE(entry.path().filename().string().starts_with("lock.")) << entry.path();
  }
}

TEST(RunJobs, AFullDiskIsSaidAndWhatIsDoneStaysDone) {
  const TemporaryFolder folder;
  const pid_t child = InProcess([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{600, 600};  // of any file: the status lines soon have no place
    ::setrlimit(RLIMIT_FSIZE, &limit);
    TinyJobs jobs{folder / "out"};
    try {
      jobs.Run();
    } catch (const Error& error) {
      ::_exit(std::string(error.what()).find("could not be written") != std::string::npos ? 5 : 6);
    }
  });
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(WEXITSTATUS(status), 5);
  TinyJobs jobs{folder / "out"};
  const JobsReport rest = jobs.Run();
  EXPECT_GT(rest.before, 0);
  EXPECT_EQ(rest.unfinished, 0);
}

TEST(JobOwner, AKilledOwnersLockIsTakenOverAndALiveOnesIsNot) {
  const TemporaryFolder folder;
  JobOwner mine(folder.Path());
  ASSERT_TRUE(mine.TryLock("mine"));
  int pipe[2];
  ASSERT_EQ(::pipe(pipe), 0);
  const pid_t child = InProcess([&] {
    JobOwner other(folder.Path());
    const char held = !other.TryLock("mine") && other.TryLock("theirs") ? 'y' : 'n';
    [[maybe_unused]] const ssize_t told = ::write(pipe[1], &held, 1);
    std::this_thread::sleep_for(std::chrono::seconds(60));
  });
  char held = 'n';
  ASSERT_EQ(::read(pipe[0], &held, 1), 1);
  EXPECT_EQ(held, 'y');
  EXPECT_FALSE(mine.TryLock("theirs"));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  // A clock that jumps, here that of the file system, means nothing.
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.Path())) {
    fs::last_write_time(entry.path(), fs::file_time_type::clock::now() + std::chrono::years(20));
  }
  bool took_over = false;
  EXPECT_TRUE(mine.TryLock("theirs", &took_over));
  EXPECT_TRUE(took_over);
  mine.Unlock("theirs");
  EXPECT_TRUE(mine.TryLock("theirs", &took_over));
  EXPECT_FALSE(took_over);
}

TEST(JobOwner, OneElsewhereIsDeadWhenItsHeartStandsStill) {
  const TemporaryFolder folder;
  const auto beat = [&](int count) {
    for (const char* file : {"owner.elsewhere-1-1-0", "away"}) {
      std::ofstream(folder / file) << "elsewhere-1-1-0 " << count << "\n";
    }
  };
  constexpr double kDeadAfter_s = 0.3;
  JobOwner mine(folder.Path(), kDeadAfter_s);
  ASSERT_TRUE(mine.TryLock("job"));
  mine.Unlock("job");
  // Its lock is where mine was.
  JobOwner probe(folder.Path(), kDeadAfter_s);
  ASSERT_TRUE(probe.TryLock("job"));
  fs::path lock;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.Path())) {
    if (entry.path().filename().string().starts_with("lock.")) lock = entry.path();
  }
  beat(1);
  fs::remove(lock);
  fs::copy_file(folder / "away", lock);
  for (int count = 2; count < 8; ++count) {
    beat(count);
    EXPECT_FALSE(mine.TryLock("job"));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  EXPECT_TRUE(mine.TryLock("job"));
  EXPECT_FALSE(probe.TryLock("job")) << "two took over";
}

TEST(JobJournal, ALineCutShortDoesNotCount) {
  const TemporaryFolder folder;
  {
    JobJournal journal(folder.Path(), "a");
    journal.Append("one", "h1", true, 0, {{"summary", 1}});
    journal.Append("two", "h2", false, 1, {{"fault", "a \"quote\"\n"}});
  }
  const fs::path file = folder / "status.a.jsonl";
  fs::resize_file(file, fs::file_size(file) - 9);
  std::ofstream(folder / "status.b.jsonl") << "[1]\nno json\n{\"name\": 7}\n";
  const JobJournal journal(folder.Path(), "c");
  EXPECT_TRUE(journal.Find("one")->done);
  EXPECT_FALSE(journal.Find("two"));
  EXPECT_EQ(journal.Line(*journal.Find("one"))["summary"], 1);
}

TEST(JobHasher, SeesContentsNotPlaces) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "a");
  fs::create_directories(folder / "b");
  const auto hash = [&](const char* folder_name, const std::string& option) {
    const std::vector<std::string> common = {"1.0", "fit"};
    const std::vector<std::string> words = {(folder / folder_name / "clip.npz").string(), option};
    return JobHasher(common).Hash(words);
  };
  WriteAtomically(folder / "a/clip.npz", "walk");
  WriteAtomically(folder / "b/clip.npz", "walk");
  EXPECT_EQ(hash("a", "left"), hash("b", "left"));
  EXPECT_NE(hash("a", "left"), hash("a", "right"));
  WriteAtomically(folder / "b/clip.npz", "wall");
  EXPECT_NE(hash("a", "left"), hash("b", "left"));
}

TEST(JobList, ReadsWordsKeysAndNames) {
  const TemporaryFolder folder;
  WriteAtomically(folder / "Größe 1.npz", "");
  WriteAtomically(folder / "right", "");
  WriteAtomically(folder / "list.txt",
                  "# clips\n\"Größe 1.npz\" mug hand=right start=3\n"
                  "\"Größe 1.npz\" mug\nwalk.npz name=\"a b\" mug # end\n");
  const std::vector<JobLine> jobs = ReadJobList(folder / "list.txt");
  ASSERT_EQ(jobs.size(), 3u);
  EXPECT_EQ(jobs[0].words, (std::vector<std::string>{(folder / "Größe 1.npz").string(), "mug"}));
  EXPECT_EQ(jobs[0].keys[0], std::pair(std::string("hand"), std::string("right")));
  EXPECT_EQ(jobs[0].name, "Größe 1_mug");
  EXPECT_EQ(jobs[1].name, "Größe 1_mug_2");
  EXPECT_EQ(jobs[2].name, "a b");
  EXPECT_EQ(jobs[2].words, (std::vector<std::string>{"walk.npz", "mug"}));
  EXPECT_THAT(jobs[2].where, HasSubstr("list.txt:4"));
}

TEST(JobList, ReadsWhatWindowsWritesAndRefusesLatin1) {
  const TemporaryFolder folder;
  WriteAtomically(folder / "list.txt", "\xEF\xBB\xBFwalk.npz mug\r\nrun.npz mug\r\n");
  const std::vector<JobLine> jobs = ReadJobList(folder / "list.txt");
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0].words, (std::vector<std::string>{"walk.npz", "mug"}));
  EXPECT_EQ(jobs[1].name, "run_mug");
  WriteAtomically(folder / "list.txt", "walk.npz mug\nwalk.npz mug name=gr\xF6\xDF\x65\n");
  EXPECT_THAT([&] { ReadJobList(folder / "list.txt"); },
              ::testing::ThrowsMessage<Error>(
                  ::testing::AllOf(HasSubstr("list.txt:2"), HasSubstr("UTF-8"))));
}

}  // namespace
}  // namespace holdfast
