// SPDX-License-Identifier: MIT
#include "apps/job_list.h"

#include <charconv>
#include <map>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{16} << 20;  // of a list: 100,000 jobs and more

// Words of a line: separated by blanks, or in double quotes. Nothing after '#'.
std::vector<std::string> Words(const std::string& line, const std::string& where) {
  std::vector<std::string> words;
  std::string word;
  bool quoted = false, any = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
      any = true;
    } else if (!quoted && c == '#') {
      break;
    } else if (!quoted && (c == ' ' || c == '\t' || c == '\r')) {
      if (any) words.push_back(word);
      word.clear();
      any = false;
    } else {
      word += c;
      any = true;
    }
  }
  if (quoted) throw Error(where, "has a quote that is not closed", "Close it with \"");
  if (any) words.push_back(word);
  return words;
}

template <typename Number>
Number ParseNumber(const std::string& text, const std::string& key, const std::string& where) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [last, fault] = std::from_chars(text.data(), end, value);
  if (fault != std::errc() || last != end) {
    throw Error(where, fmt::format("{}={} is not a number", key, text), "Write it like end=120");
  }
  return value;
}

// A path relative to the list, unless there is no such file: then it is an embedded name.
std::string Resolve(const std::string& word, const fs::path& folder, const std::string& where) {
  const fs::path beside = folder / word;
  std::error_code error;
  const bool there = fs::exists(beside, error);
  if (error) {
    throw Error(where, fmt::format("'{}' cannot be used ({})", word, error.message()),
                "Check the path");
  }
  return there ? beside.string() : word;
}

void SetKey(const std::string& key, const std::string& value, const std::string& where,
            FitJob& job) {
  if (key == "hand") {
    static const std::set<std::string> hands = {"auto", "right", "left", "both"};
    if (!hands.contains(value)) {
      throw Error(where, fmt::format("hand={} is not a hand", value),
                  "Write hand=right, left, both or auto");
    }
    job.hand = value;
  } else if (key == "name") {
    if (value.empty() || value.find('/') != std::string::npos || value.front() == '.') {
      throw Error(where, fmt::format("name={} is not a folder name", value),
                  "Use a plain name without slashes");
    }
    job.output = value;
  } else if (key == "start") {
    job.start = ParseNumber<int>(value, key, where);
  } else if (key == "end") {
    job.end = ParseNumber<int>(value, key, where);
  } else if (key == "object-scale") {
    job.object_scale = ParseNumber<double>(value, key, where);
    if (!(job.object_scale >= 1e-6 && job.object_scale <= 1e6)) {
      throw Error(where, "object-scale is not within 1e-6 and 1e6",
                  "Write it like object-scale=0.001");
    }
  } else {
    throw Error(where, fmt::format("has an unknown key '{}'", key),
                "Keys are hand, name, start, end, object-scale");
  }
}

}  // namespace

std::vector<FitJob> ReadJobList(const fs::path& path, const FitJob& common_job) {
  std::istringstream file(ReadFile(path, kMostBytes));
  std::vector<FitJob> jobs;
  std::set<std::string> taken;
  std::map<std::string, int> uses;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string where = fmt::format("{}:{}", path.string(), number);
    const std::vector<std::string> words = Words(line, where);
    if (words.empty()) continue;
    if (words.size() < 2) {
      throw Error(where, "has no object", "Write CLIP OBJECT [key=value ...]");
    }
    FitJob job = common_job;
    job.output.clear();
    job.clip = Resolve(words[0], path.parent_path(), where);
    job.object = Resolve(words[1], path.parent_path(), where);
    for (std::size_t w = 2; w < words.size(); ++w) {
      const auto equals = words[w].find('=');
      if (equals == std::string::npos) {
        throw Error(where, fmt::format("'{}' is not key=value", words[w]),
                    "Write it like hand=left");
      }
      SetKey(words[w].substr(0, equals), words[w].substr(equals + 1), where, job);
    }
    if (job.output.empty()) {
      const std::string base =
          fs::path(words[0]).stem().stem().string() + "_" + fs::path(words[1]).stem().string();
      do {
        const int use = ++uses[base];
        job.output = use == 1 ? base : fmt::format("{}_{}", base, use);
      } while (taken.contains(job.output));
    }
    if (!taken.insert(job.output).second) {
      throw Error(where, fmt::format("repeats the name '{}'", job.output),
                  "Give each job another name=");
    }
    jobs.push_back(std::move(job));
  }
  if (jobs.empty()) {
    throw Error(path.string(), "has no job", "Write CLIP OBJECT [key=value ...] on each line");
  }
  return jobs;
}

}  // namespace holdfast::apps
