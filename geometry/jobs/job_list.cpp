// SPDX-License-Identifier: MIT
#include "geometry/jobs/job_list.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/data_store.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = std::size_t{16} << 20;  // of a list: over 100,000 jobs

// Splits a line into words, separated by blanks or enclosed in double quotes. '#' ends the line.
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

// Returns the path of `word` relative to the list if such a file exists, else `word` itself.
std::string Resolve(const std::string& word, const fs::path& folder, const std::string& where) {
  std::error_code error;
  const fs::path beside = folder / word;
  const bool there = !word.empty() && fs::exists(beside, error);
  if (error) {
    throw Error(where, fmt::format("'{}' cannot be used ({})", word, error.message()),
                "Check the path");
  }
  return there ? beside.string() : word;
}

// Position of '=' in key=value; npos for a word, or for an existing file with such a name.
std::size_t EqualsOf(const std::string& word, const fs::path& folder) {
  const std::size_t equals = word.find('=');
  if (equals == 0 || equals == word.npos) return word.npos;
  const bool is_key =
      std::all_of(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(equals),
                  [](unsigned char c) { return std::islower(c) || std::isdigit(c) || c == '-'; });
  std::error_code ignored;
  return is_key && !fs::exists(folder / word, ignored) ? equals : word.npos;
}

void RequireName(const std::string& name, const std::string& where) {
  if (name.empty() || name.find('/') != name.npos || name.front() == '.') {
    throw Error(where, fmt::format("name={} is not a file or folder name", name),
                "Use a plain name without slashes");
  }
}

// Builds a name from the stems of the words: "walk_mug" from walk.npz and mug.obj.
std::string NameOf(const std::vector<std::string>& words) {
  std::string name;
  for (const std::string& word : words) {
    fs::path path(word);
    if (path.filename().empty()) path = path.parent_path();  // "held/"
    if (!name.empty()) name += '_';
    name += name.empty() ? path.stem().stem().string() : path.stem().string();
  }
  return name.empty() || name.front() == '.' ? "job" : name;
}

JobLine ReadLine(const std::vector<std::string>& words, const fs::path& folder, std::string where) {
  JobLine job;
  job.where = std::move(where);
  for (const std::string& word : words) {
    const std::size_t equals = EqualsOf(word, folder);
    if (equals == word.npos) {
      job.words.push_back(word);
      continue;
    }
    const std::string key = word.substr(0, equals), value = word.substr(equals + 1);
    if (key == "name") {
      RequireName(value, job.where);
      job.name = value;
    } else {
      // A choice such as hand=right is not a file, even if a file of that name is next to the list.
      const bool may_be_file = value.find_first_of("./") != value.npos;
      job.keys.emplace_back(key, may_be_file ? Resolve(value, folder, job.where) : value);
    }
  }
  if (job.words.empty()) {
    throw Error(job.where, "has no argument", "Write the command's arguments, then key=value ...");
  }
  return job;
}

}  // namespace

std::vector<JobLine> ReadJobList(const fs::path& path) {
  std::string text = ReadFile(path, kMaxBytes);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  std::istringstream file(std::move(text));
  std::vector<JobLine> jobs;
  std::set<std::string> taken;
  std::map<std::string, int> uses;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string where = fmt::format("{}:{}", path.string(), number);
    // Status lines are JSON: a name in another encoding would not be found again there.
    if (!IsUtf8(line)) throw Error(where, "is not UTF-8", "Save the list as UTF-8");
    const std::vector<std::string> words = Words(line, where);
    if (words.empty()) continue;
    JobLine job = ReadLine(words, path.parent_path(), where);
    if (job.name.empty()) {
      const std::string base = NameOf(job.words);
      do {
        const int use = ++uses[base];
        job.name = use == 1 ? base : fmt::format("{}_{}", base, use);
      } while (taken.contains(job.name));
    }
    if (!taken.insert(job.name).second) {
      throw Error(where, fmt::format("repeats the name '{}'", job.name),
                  "Give each job another name=");
    }
    for (std::string& word : job.words) word = Resolve(word, path.parent_path(), where);
    jobs.push_back(std::move(job));
  }
  if (jobs.empty()) {
    throw Error(path.string(), "has no job", "Write a job's arguments on each line");
  }
  return jobs;
}

namespace {

constexpr std::size_t kMaxSeen = 4096;

// Checksum of the file names and contents in a folder, in the order of the names. Hidden files are
// skipped: they may be work in progress.
std::string FolderMeaning(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const bool hidden = entry.path().filename().string().starts_with('.');
    if (entry.is_regular_file() && !hidden) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::string text;
  for (const fs::path& file : files) {
    text += file.lexically_relative(folder).string() + '\0' + Checksum(ByteSource(file)) + '\0';
  }
  return Checksum(text);
}

std::string LastName(const fs::path& path) {
  return (path.filename().empty() ? path.parent_path() : path).filename().string();
}

// Name and content of a file or folder; nullopt if `word` names neither.
std::optional<std::string> ContentOf(const std::string& word) {
  std::error_code none;
  const fs::path path(word);
  if (word.empty()) return std::nullopt;
  const fs::file_status status = fs::status(path, none);
  if (fs::is_regular_file(status)) return LastName(path) + '\0' + Checksum(ByteSource(path));
  if (fs::is_directory(status)) return LastName(path) + '\0' + FolderMeaning(path);
  return std::nullopt;
}

}  // namespace

JobHasher::JobHasher(std::span<const std::string> common) {
  for (const std::string& word : common) common_ += Meaning(word) + '\0';
}

std::string JobHasher::Meaning(const std::string& word) {
  {
    const std::lock_guard guard(lock_);
    if (const auto known = seen_.find(word); known != seen_.end()) return known->second;
  }
  const std::optional<std::string> content = ContentOf(word);
  if (!content) return word;
  const std::lock_guard guard(lock_);
  if (seen_.size() >= kMaxSeen) seen_.clear();
  return seen_[word] = *content;
}

std::string JobHasher::Hash(std::span<const std::string> words) {
  std::string text = common_;
  for (const std::string& word : words) text += Meaning(word) + '\0';
  return Checksum(text);
}

}  // namespace holdfast
