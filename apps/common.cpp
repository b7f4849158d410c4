// SPDX-License-Identifier: MIT
#include "apps/common.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "apps/config_file.h"
#include "generator/body/rest_pelvis_note.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"

namespace holdfast::apps {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

const Clock::time_point kStart = Clock::now();

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

bool LogsJson(const CommonOptions& options) { return options.log == "json"; }

// Logs the resource usage of the whole run so far.
void TellUsage(const CommonOptions& options) {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  const double wall_s = SecondsSince(kStart);
  const double cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  const double peak_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
  Detail(options, "usage",
         fmt::format("took {:.2f} s, CPU time {:.2f} s, peak memory {:.0f} MB", wall_s, cpu_s,
                     peak_mb),
         {{"seconds", wall_s}, {"processor_seconds", cpu_s}, {"peak_memory_mb", peak_mb}});
}

}  // namespace

void AddCommonOptions(CLI::App& command, CommonOptions& options, bool writes,
                      std::string_view examples) {
  command.add_flag("--json", options.json, "Print the summary as JSON");
  CLI::Option* const quiet =
      command.add_flag("--quiet,-q", options.quiet,
                       "Print no progress and no notes on stderr; warnings and errors remain");
  command
      .add_flag("--verbose,-v", options.verbose,
                "Print details on stderr: loaded files, time of each stage")
      ->excludes(quiet);
  AddOption(command, "--log", options.log,
            "Format of stderr: text, json (one object per line), or none (errors only)",
            CLI::IsMember({"text", "json", "none"}));
  AddOption(command, "--threads", options.threads,
            "Number of threads; 0: all cores available to the process", CLI::Range(0, 1024));
  AddOption(command, "--seed", options.seed, "Random seed");
  if (writes) command.add_flag("--force,-f", options.force, "Overwrite existing output");
  AddConfigOptions(command);
  command.footer(fmt::format("\nExamples:\n{}", examples));
}

namespace {

template <typename T>
CLI::Option* Checked(CLI::Option* option, const OptionRange& range) {
  if (range.positive) return option->check(CLI::PositiveNumber);
  if (!std::isfinite(range.low)) return option;
  if (!std::isfinite(range.high)) return option->check(CLI::NonNegativeNumber);
  return option->check(CLI::Range(static_cast<T>(range.low), static_cast<T>(range.high)));
}

// Adds one option of a table to CLI11.
struct Declare {
  CLI::App& command;
  const Option& option;

  CLI::Option* operator()(bool* value) const {
    if (!option.flag.starts_with("--no-"))
      return command.add_flag(option.flag, *value, option.help);
    std::string off = option.help;
    off[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(off[0])));
    return command.add_flag_callback(
        option.flag, [value] { *value = false; }, "Do not " + off);
  }
  template <typename T>
  CLI::Option* operator()(T* value) const {
    return Checked<T>(command.add_option(option.flag, *value, option.help)->capture_default_str(),
                      option.range);
  }
  CLI::Option* operator()(std::string* value) const {
    return command.add_option(option.flag, *value, option.help)->capture_default_str();
  }
  template <typename T>
  CLI::Option* operator()(std::optional<T>* value) const {
    const std::string help = fmt::format("{} [{}]", option.help, option.default_text);
    return Checked<T>(command.add_option(option.flag, *value, help), option.range);
  }
  CLI::Option* operator()(std::vector<int>* value) const {
    return command.add_option(option.flag, *value, option.help)
        ->delimiter(',')
        ->check(CLI::NonNegativeNumber);
  }
  CLI::Option* operator()(std::pair<int, int>* value) const {
    const auto parsed = [range = option.range](const std::string& text) {
      std::pair<int, int> pair;
      const char* const end = text.data() + text.size();
      const auto first = std::from_chars(text.data(), end, pair.first);
      const bool separated = first.ec == std::errc() && first.ptr != end && *first.ptr == 'x';
      const auto second = std::from_chars(separated ? first.ptr + 1 : end, end, pair.second);
      const bool valid = separated && second.ec == std::errc() && second.ptr == end &&
                         range.Contains(pair.first) && range.Contains(pair.second);
      return valid ? std::optional(pair) : std::nullopt;
    };
    return command
        .add_option_function<std::string>(
            option.flag, [parsed, value](const std::string& text) { *value = *parsed(text); },
            option.help)
        ->default_str(fmt::format("{}x{}", value->first, value->second))
        ->check([parsed, range = option.range](const std::string& text) {
          return parsed(text) ? std::string()
                              : fmt::format("'{}' is not two numbers ({:g} to {:g}) like 4x2", text,
                                            range.low, range.high);
        });
  }
  CLI::Option* operator()(const ScaledNumber& number) const {
    CLI::Option* const added = command.add_option_function<double>(
        option.flag, [number](const double& value) { *number.variable = number.unit * value; },
        option.help);
    return Checked<double>(added->default_str(fmt::format("{:g}", *number.variable / number.unit)),
                           option.range);
  }
  CLI::Option* operator()(const OptionChoice& choice) const {
    CLI::Option* const added = command.add_option_function<std::string>(
        option.flag,
        [choice](const std::string& word) {
          choice.set(static_cast<std::size_t>(std::ranges::find(choice.words, word) -
                                              choice.words.begin()));
        },
        option.help);
    return added->default_str(choice.words[choice.get()])->check(CLI::IsMember(choice.words));
  }
};

}  // namespace

void AddOptions(CLI::App& command, const OptionTable& table) {
  for (const Option& option : table.All()) {
    CLI::Option* const added = std::visit(Declare{command, option}, option.value);
    if (!option.group.empty()) added->group(option.group);
  }
}

int NumThreads(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  return AvailableThreads();
}

void LogJson(std::string_view level, std::string_view event, const nlohmann::ordered_json& fields) {
  const auto now =
      std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto second = std::chrono::floor<std::chrono::seconds>(now);
  nlohmann::ordered_json line = {
      {"time",
       fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                   (now - second).count())},
      {"level", level},
      {"event", event}};
  line.update(fields);
  fmt::print(stderr, "{}\n", JsonText(line));
}

void Note(const CommonOptions& options, std::string_view text) {
  const bool warns = text.starts_with("warning: ") || text.starts_with("note: warning: ");
  if (options.log == "none" || (options.quiet && !warns)) return;
  // Notes from loading a file may include warnings.
  if (text.starts_with("note: warning: ")) text.remove_prefix(std::string_view("note: ").size());
  if (!LogsJson(options)) {
    fmt::print(stderr, "{}\n", text);
    return;
  }
  std::string_view level = "info";
  for (const std::string_view prefix : {"note: ", "warning: "}) {
    if (!text.starts_with(prefix)) continue;
    if (prefix == "warning: ") level = "warning";
    text.remove_prefix(prefix.size());
    break;
  }
  LogJson(level, "note", {{"message", text}});
}

void WarnOfOldPelvis(const std::string& source, const std::map<std::string, std::string>& notes,
                     const CommonOptions& options) {
  if (const auto old = OldPelvisWarning(source, notes)) Note(options, "warning: " + *old);
}

void Detail(const CommonOptions& options, std::string_view event, std::string_view text,
            const nlohmann::ordered_json& fields) {
  if (!options.verbose) return;
  if (LogsJson(options)) {
    LogJson("debug", event, fields);
  } else {
    fmt::print(stderr, "{}\n", text);
  }
}

Progress::Progress(const CommonOptions& options, std::string label)
    : options_(options),
      terminal_(::isatty(STDERR_FILENO) != 0),
      label_(std::move(label)),
      begin_(Clock::now()),
      last_(begin_) {}

Progress::~Progress() {
  if (line_open_) fmt::print(stderr, "\n");
  if (total_ <= 0) return;
  const double seconds = SecondsSince(begin_);
  Detail(options_, "stage", fmt::format("{}: {} of {} in {:.2f} s", label_, done_, total_, seconds),
         {{"stage", label_}, {"done", done_}, {"total", total_}, {"seconds", seconds}});
}

void Progress::Update(int done, int total) {
  done_ = done;
  total_ = total;
  if (options_.quiet || options_.log == "none" || total <= 0) return;
  const bool json = LogsJson(options_);
  const auto now = Clock::now();
  const auto pause = std::chrono::milliseconds(json        ? 1000
                                               : terminal_ ? 100
                                                           : 5000);  // terminal, log
  if (now - last_ < pause && done < total) return;
  if (!json && !terminal_ && now - begin_ < pause) return;  // keeps short work out of logs
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  const double left = done > 0 ? elapsed / done * (total - done) : 0.0;
  if (json) {
    LogJson("info", "progress",
            {{"stage", label_}, {"done", done}, {"total", total}, {"seconds_left", left}});
    return;
  }
  const std::string line = fmt::format("{}: {}/{}, {:.0f} s left", label_, done, total, left);
  if (terminal_) {
    fmt::print(stderr, "\r{:<78}", line);
    line_open_ = true;
  } else {
    fmt::print(stderr, "{}\n", line);
  }
}

std::shared_ptr<const BodyModel> LoadBody(const std::string& path) {
  return path.empty() ? BodyModel::Default() : BodyModel::Load(path);
}

std::optional<std::vector<double>> NumbersFrom(std::string_view text, std::size_t count) {
  std::vector<double> numbers(count);
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t k = 0; k < count; ++k) {
    const auto [next, error] = std::from_chars(at, end, numbers[k]);
    const bool last = k + 1 == count;
    if (error != std::errc() || !std::isfinite(numbers[k]) ||
        (last ? next != end : next == end || *next != ',')) {
      return std::nullopt;
    }
    at = next + 1;
  }
  return numbers;
}

void RequireNew(const fs::path& path, const CommonOptions& options) {
  RequireNewFolder(path, options);
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw Error(path.string(), "is a folder, expected a file", "Choose a file name");
  }
}

void RequireNewFolder(const fs::path& path, const CommonOptions& options) {
  if (path.empty()) throw Error("--output", "is empty", "Give the name of the output");
  std::error_code error;
  if (!options.force && fs::exists(path, error)) {
    throw Error(path.string(), "exists already", "Choose another name, or give --force");
  }
  fs::path above = fs::absolute(path, error).parent_path();
  while (!fs::exists(above, error) && above.has_relative_path()) above = above.parent_path();
  const bool folder = fs::is_directory(above, error);
  if (folder && ::access(above.c_str(), W_OK | X_OK) == 0) return;
  throw Error(path.string(),
              fmt::format("cannot be written: '{}' is {}", above.string(),
                          folder ? "read-only" : "not a folder"),
              "Choose another place");
}

nlohmann::json JsonHead(std::string_view schema, const CommonOptions& options) {
  return {{"schema", schema}, {"holdfast_version", HOLDFAST_VERSION}, {"seed", options.seed}};
}

namespace {

thread_local ResultCapture* capture = nullptr;

}  // namespace

ResultCapture::ResultCapture() { capture = this; }

ResultCapture::~ResultCapture() { capture = nullptr; }

bool InBatch() { return capture != nullptr; }

void PrintResult(const CommonOptions& options, const nlohmann::json& summary,
                 std::string_view text) {
  if (capture != nullptr) {
    capture->summary_ = summary;
    return;
  }
  if (options.json) {
    fmt::print("{}\n", JsonText(summary, 2));
  } else {
    fmt::print("{}", text);
  }
  std::fflush(stdout);
  TellUsage(options);
  if (LogsJson(options) && !options.quiet) LogJson("info", "summary", {{"summary", summary}});
}

}  // namespace holdfast::apps
