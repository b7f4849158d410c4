// SPDX-License-Identifier: MIT
#include "apps/batch.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/common.h"
#include "apps/program.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/jobs/job_list.h"
#include "geometry/jobs/run_jobs.h"
#include "geometry/suggestion.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct BatchOptions {
  std::string list;
  std::string shard = "1/1";
  bool retry_failed = false;
};

// Options of the run as a whole, which a job cannot set.
bool IsOfTheRun(const CLI::Option& option) {
  static const std::set<std::string> names = {
      "batch", "shard", "retry-failed", "output", "json",         "quiet", "verbose",
      "log",   "force", "threads",      "config", "print-config", "help"};
  return option.get_lnames().empty() || names.contains(option.get_lnames().front());
}

struct Shard {
  int index = 0, count = 0;
};

Shard ParseShard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.index);
  const bool parted = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
  const auto second = std::from_chars(parted ? first.ptr + 1 : end, end, shard.count);
  const bool whole = parted && second.ec == std::errc() && second.ptr == end;
  return whole && shard.index >= 1 && shard.index <= shard.count ? shard : Shard{};
}

const CLI::Option* FindKey(const CLI::App& command, const std::string& key) {
  const CLI::Option* const option = command.get_option_no_throw("--" + key);
  return option == nullptr || IsOfTheRun(*option) ? nullptr : option;
}

// Options of the command line for all jobs, each as its name and values.
std::vector<std::vector<std::string>> SharedOptions(const CLI::App& command) {
  std::vector<std::vector<std::string>> shared;
  for (const CLI::Option* option : command.get_options()) {
    if (option->empty() || IsOfTheRun(*option)) continue;
    std::vector<std::string>& words = shared.emplace_back();
    words.push_back("--" + option->get_lnames().front());
    if (option->get_expected_max() == 0) {
      words.front() += "=" + option->results().back();  // a flag
    } else {
      for (const std::string& value : option->results()) words.push_back(value);
    }
  }
  return shared;
}

// The part of a command's summary that describes only the result.
nlohmann::json SummaryOfResult(nlohmann::json summary) {
  if (!summary.is_object()) return {};
  if (summary.contains("summary")) summary = nlohmann::json(summary["summary"]);
  for (const char* shared : {"schema", "holdfast_version", "seed", "options", "output"}) {
    summary.erase(shared);
  }
  TakeWallTimes(summary);
  return summary;
}

// Why a result that was written does not meet the requirements.
std::string FaultOf(const nlohmann::json& summary) {
  const auto warnings = summary.find("warnings");
  if (warnings == summary.end() || warnings->empty()) {
    return "the result does not meet the requirements";
  }
  return fmt::format("{}", fmt::join(warnings->get<std::vector<std::string>>(), "; "));
}

// The jobs of a list, and how to run each of them.
class Batch {
 public:
  Batch(const CLI::App& parsed, const BatchCommand& command, const BatchOptions& options)
      : command_(command),
        lines_(ReadJobList(options.list)),
        shared_(SharedOptions(parsed)),
        folder_(parsed.get_option("--output")->as<std::string>()),
        hasher_(CommonWords()) {
    RequireLinesRead();
  }

  std::vector<Job> Jobs() {
    std::vector<Job> jobs;
    for (const JobLine& line : lines_) {
      jobs.push_back({line.name, ResultOf(line), WordsOf(line),
                      [this, &line] { return hasher_.Hash(WordsOf(line)); }});
    }
    return jobs;
  }

  std::optional<JobOutcome> Run(std::size_t index) const {
    const JobLine& line = lines_[index];
    JobOutcome outcome;
    const ResultCapture captured;
    try {
      CLI::App app("", "holdfast");
      CLI::App& own = Add(app, outcome.exit_code);
      ParseJob(app, ArgumentsOf(own, line), line.where);
      std::error_code ignored;
      outcome.done = outcome.exit_code == kDone ||
                     (outcome.exit_code == kFitFault && fs::exists(ResultOf(line), ignored));
      if (outcome.exit_code != kDone) outcome.fault = FaultOf(captured.Summary());
      outcome.summary = SummaryOfResult(captured.Summary());
    } catch (const FitFailure& failure) {
      outcome.exit_code = kFitFault;
      outcome.fault = failure.what();
    } catch (const std::exception& error) {
      outcome.exit_code = kInputFault;
      outcome.fault = error.what();
    }
    if (Interrupted()) return std::nullopt;
    return outcome;
  }

 private:
  CLI::App& Add(CLI::App& app, int& exit_code) const {
    command_.add(app, exit_code);
    RequireNumbersInRange(app);
    return *app.get_subcommand(command_.name);
  }

  std::vector<std::string> CommonWords() const {
    std::vector<std::string> words = {HOLDFAST_VERSION, command_.name};
    for (const auto& option : shared_) words.insert(words.end(), option.begin(), option.end());
    return words;
  }

  // Words that identify a job; file names are separate words, for the hash.
  static std::vector<std::string> WordsOf(const JobLine& line) {
    std::vector<std::string> words = line.words;
    for (const auto& [key, value] : line.keys) {
      words.push_back("--" + key);
      words.push_back(value);
    }
    return words;
  }

  fs::path ResultOf(const JobLine& line) const {
    const std::vector<std::string>& known = command_.extensions;
    const bool has_own =
        known.empty() || std::ranges::count(known, fs::path(line.name).extension().string()) > 0;
    return folder_ / (has_own ? line.name : line.name + known.front());
  }

  std::vector<std::string> ArgumentsOf(const CLI::App& own, const JobLine& line) const {
    std::vector<std::string> words = JobArguments(own, line);
    words.insert(words.begin(), command_.name);
    words.insert(words.end(), {"--output=" + ResultOf(line).string(), "--log=none", "--threads=1"});
    if (own.get_option_no_throw("--force") != nullptr) words.push_back("--force");
    for (const auto& option : shared_) {
      const std::string key = option.front().substr(2, option.front().find('=') - 2);
      const auto overrides = [&](const auto& own_key) { return own_key.first == key; };
      if (std::ranges::any_of(line.keys, overrides)) continue;
      words.insert(words.end(), option.begin(), option.end());
    }
    return words;
  }

  // Parses every line before any job runs. The program's commands stop before they start.
  void RequireLinesRead() const {
    struct Reads {};
    int unused = 0;
    CLI::App app("", "holdfast");
    CLI::App& own = Add(app, unused);
    own.parse_complete_callback([] { throw Reads(); });
    std::set<fs::path> results = {folder_ / "manifest.json"};
    for (const JobLine& line : lines_) {
      try {
        ParseJob(app, ArgumentsOf(own, line), line.where);
      } catch (const Reads&) {
      }
      if (results.insert(ResultOf(line)).second) continue;
      throw Error(line.where, fmt::format("would write '{}' again", ResultOf(line).string()),
                  "Give each job a different name=");
    }
  }

  const BatchCommand& command_;
  const std::vector<JobLine> lines_;
  const std::vector<std::vector<std::string>> shared_;
  const fs::path folder_;
  JobHasher hasher_;
};

Outcome RunBatch(const CLI::App& parsed, const BatchCommand& command, const BatchOptions& options) {
  // Options of the run, in the form of CommonOptions.
  CommonOptions common;
  const auto is_set = [&](const char* name) {
    const CLI::Option* const option = parsed.get_option_no_throw(name);
    return option != nullptr && !option->empty();
  };
  common.json = is_set("--json");
  common.quiet = is_set("--quiet");
  common.verbose = is_set("--verbose");
  common.force = is_set("--force");
  common.log = parsed.get_option("--log")->as<std::string>();
  common.threads = parsed.get_option("--threads")->as<int>();
  common.seed = parsed.get_option("--seed")->as<std::uint64_t>();
  const Shard shard = ParseShard(options.shard);

  Batch batch(parsed, command, options);
  const std::vector<Job> jobs = batch.Jobs();
  JobsOptions run;
  run.folder = parsed.get_option("--output")->as<std::string>();
  run.kind = command.name;
  run.head = JsonHead("holdfast/batch/1", common);
  run.shard = shard.index;
  run.shards = shard.count;
  run.retry_failed = options.retry_failed;
  run.replace = common.force;
  run.threads = NumThreads(common);
  JobsReport report;
  {
    const int total = static_cast<int>(jobs.size()) / shard.count;
    Progress progress(common, command.name);
    report = RunJobs(
        jobs, run, [&](std::size_t index) { return batch.Run(index); },
        [&](const std::string& name, const JobOutcome& outcome, int finished) {
          if (!outcome.fault.empty()) Note(common, fmt::format("{}: {}", name, outcome.fault));
          progress.Update(finished, std::max(total, finished));
        },
        Interrupted);
  }
  if (report.stopped) return {kInterrupted, {}, {}};

  Outcome outcome;
  outcome.exit_code = report.exit_code;
  outcome.summary = run.head;
  outcome.summary.update({{"command", command.name},
                          {"output", run.folder.string()},
                          {"jobs", report.jobs},
                          {"failed", report.failed},
                          {"done_before", report.before},
                          {"unfinished", report.unfinished}});
  const bool complete = report.unfinished == 0;
  outcome.text = fmt::format(
      "{}: {} jobs, {} failed{}{}\n",
      (complete ? run.folder / "manifest.json" : run.folder).string(), report.jobs, report.failed,
      report.before > 0 ? fmt::format(" ({} done before)", report.before) : "",
      complete ? "" : fmt::format("; {} jobs of the whole list not done yet", report.unfinished));
  return outcome;
}

// A command may require a file extension, which a folder does not have.
void AcceptAnyName(CLI::Option& output) {
  try {
    output.get_validator(0)->active(false);
  } catch (const CLI::OptionNotFound&) {  // none required
  }
}

// Makes the command run the list and end before its own start. Its callback is kept, since it owns
// the variables of the options.
void BecomeBatch(CLI::App& own, const BatchCommand& command,
                 const std::shared_ptr<BatchOptions>& options) {
  for (CLI::Option* option : own.get_options()) {
    if (option->get_positional()) option->required(false);
  }
  AcceptAnyName(*own.get_option("--output"));
  own.parse_complete_callback([&own, command, options] {
    if (own.remaining_size() > 0) throw CLI::ExtrasError(own.remaining());
    for (const CLI::Option* option : own.get_options()) {
      if (option->get_positional() && !option->empty()) {
        throw CLI::ExcludesError(option->get_name(true), "--batch");
      }
    }
    if (own.get_option("--output")->empty()) throw CLI::RequiredError("--output");
    const Outcome outcome = RunBatch(own, command, *options);
    if (!outcome.summary.is_null()) {
      CommonOptions common;
      common.json = !own.get_option("--json")->empty();
      PrintResult(common, outcome.summary, outcome.text);
    }
    throw Ended{outcome.exit_code};
  });
}

}  // namespace

std::vector<std::string> JobArguments(const CLI::App& command, const JobLine& line) {
  std::vector<const CLI::Option*> positionals;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) positionals.push_back(option);
  }
  if (line.words.size() < positionals.size()) {
    throw Error(line.where,
                fmt::format("has no {}", positionals[line.words.size()]->get_name(true)),
                "Write the command's arguments, then key=value ...");
  }
  const bool takes_more = std::ranges::any_of(
      positionals, [](const CLI::Option* option) { return option->get_expected_max() > 1; });
  if (line.words.size() > positionals.size() && !takes_more) {
    throw Error(line.where,
                fmt::format("has an extra argument '{}'", line.words[positionals.size()]),
                "Write options like hand=left");
  }
  for (const std::string& word : line.words) {
    if (!word.starts_with('-')) continue;
    throw Error(line.where, fmt::format("has an invalid argument '{}'", word),
                "Write options like hand=left");
  }
  std::vector<std::string> words = line.words;
  for (const auto& [key, value] : line.keys) {
    const CLI::Option* const option = FindKey(command, key);
    if (option == nullptr) {
      std::vector<std::string> known;
      for (const CLI::Option* candidate : command.get_options()) {
        if (!IsOfTheRun(*candidate)) known.push_back(candidate->get_lnames().front());
      }
      throw Error(line.where, fmt::format("has an unknown key '{}'", key),
                  Suggestion(key, known) + "Use name or the command's options without dashes");
    }
    words.push_back(fmt::format("--{}={}", key, value));
  }
  return words;
}

void ParseJob(CLI::App& app, const std::vector<std::string>& arguments, const std::string& where) {
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::ParseError& error) {
    throw Error(where, fmt::format("cannot be parsed ({})", error.what()), "Correct the line");
  }
}

void AddBatchable(CLI::App& app, const BatchCommand& command, int& exit_code) {
  command.add(app, exit_code);
  CLI::App& own = *app.get_subcommand(command.name);
  auto options = std::make_shared<BatchOptions>();
  const char* const group = "Batch processing";
  own.add_option_function<std::string>(
         "--batch",
         [&own, command, options](const std::string& list) {
           options->list = list;
           BecomeBatch(own, command, options);
         },
         "File with one job per line: the command's arguments, then key=value for the job's "
         "options, and name=NAME to name its result. -o is the folder for all results. To resume "
         "an interrupted batch, run it again; several processes may share the folder")
      ->trigger_on_parse()
      ->group(group);
  AddOption(
      own, "--shard", options->shard,
      "K/N: run every N-th job of the list, starting with the K-th; for job arrays on a cluster",
      CLI::Validator(
          [](const std::string& text) {
            return ParseShard(text).count > 0
                       ? std::string()
                       : fmt::format("{} is not K/N with K from 1 to N", text);
          },
          "K/N"))
      ->needs("--batch")
      ->group(group);
  own.add_flag("--retry-failed", options->retry_failed, "Retry jobs that failed before")
      ->needs("--batch")
      ->group(group);
}

}  // namespace holdfast::apps
