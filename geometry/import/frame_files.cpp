// SPDX-License-Identifier: MIT
#include "geometry/import/frame_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 6> kExtensions = {".pkl",  ".npz", ".npy",
                                                         ".json", ".pt",  ".pth"};
constexpr std::size_t kMaxFiles = 200'000;

bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::vector<fs::path> Sorted(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with('.')) continue;
    entries.push_back(entry.path());
    if (entries.size() > kMaxFiles) {
      throw Error(folder.string(), fmt::format("holds more than {} files", kMaxFiles),
                  "Give a folder of one sequence");
    }
  }
  std::ranges::sort(entries, [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.filename().string(), b.filename().string());
  });
  return entries;
}

// The extension that most of the files have.
std::string CommonExtension(const std::vector<fs::path>& files) {
  std::map<std::string, int> count;
  for (const fs::path& file : files) {
    const std::string extension = file.extension().string();
    if (std::ranges::find(kExtensions, extension) != kExtensions.end()) ++count[extension];
  }
  std::string common;
  for (const auto& [extension, n] : count) {
    if (common.empty() || n > count[common]) common = extension;
  }
  return common;
}

// "00012_1" is frame "00012" of person 1; nothing for other names.
std::optional<std::pair<std::string, int>> FrameAndPerson(const std::string& stem) {
  const std::size_t bar = stem.rfind('_');
  if (bar == std::string::npos || bar == 0 || bar + 1 == stem.size()) return std::nullopt;
  const std::string person = stem.substr(bar + 1);
  if (person.size() > 3 || !std::ranges::all_of(person, IsDigit) || !IsDigit(stem[bar - 1])) {
    return std::nullopt;
  }
  return std::pair(stem.substr(0, bar), std::stoi(person));
}

// The last number in a name; nothing when there is none (or no sensible one).
std::optional<long> NumberIn(const std::string& stem) {
  const auto last = std::find_if(stem.rbegin(), stem.rend(), IsDigit);
  if (last == stem.rend()) return std::nullopt;
  const auto first = std::find_if_not(last, stem.rend(), IsDigit);
  const std::string digits(first.base(), last.base());
  if (digits.size() > 9) return std::nullopt;
  return std::stol(digits);
}

// Numbers missing between the first and the last.
int CountMissing(const std::vector<std::string>& frames) {
  if (frames.size() < 2) return 0;
  const std::optional<long> first = NumberIn(frames.front()), last = NumberIn(frames.back());
  if (!first || !last) return 0;
  const long missing = *last - *first + 1 - static_cast<long>(frames.size());
  return missing > 0 && missing < 1'000'000 ? static_cast<int>(missing) : 0;
}

}  // namespace

bool NaturalLess(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!IsDigit(a[i]) || !IsDigit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [](const std::string& text, std::size_t& at) {
      const std::size_t begin = at;
      while (at < text.size() && IsDigit(text[at])) ++at;
      const std::size_t digits = std::min(text.find_first_not_of('0', begin), at);
      return text.substr(digits, at - digits);
    };
    const std::string m = number(a, i), n = number(b, j);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  if (i == a.size() && j == b.size()) return a < b;  // "01" and "1": some order
  return i == a.size();
}

FrameFiles FindFrameFiles(const fs::path& folder, int person) {
  std::vector<fs::path> files, folders;
  for (const fs::path& entry : Sorted(folder)) {
    std::error_code ignored;
    (fs::is_directory(entry, ignored) ? folders : files).push_back(entry);
  }
  FrameFiles found;
  std::vector<std::string> frames;
  const auto no_person = [&](const std::string& frame, std::size_t people) {
    return Error(folder.string(),
                 fmt::format("has no person {} in frame {}, only {}", person, frame, people),
                 "Choose another with --person");
  };
  std::string extension = CommonExtension(files);
  if (extension.empty()) {
    // A folder a frame, with a file a person.
    for (const fs::path& frame : folders) {
      std::vector<fs::path> people;
      for (const fs::path& file : Sorted(frame)) {
        if (extension.empty()) extension = CommonExtension({file});
        if (!extension.empty() && file.extension() == extension) people.push_back(file);
      }
      if (people.empty()) continue;
      found.people = std::max(found.people, static_cast<int>(people.size()));
      const std::string name = frame.filename().string();
      if (static_cast<std::size_t>(person) >= people.size()) throw no_person(name, people.size());
      found.files.push_back(people[static_cast<std::size_t>(person)]);
      frames.push_back(name);
    }
  } else {
    std::erase_if(files, [&](const fs::path& file) { return file.extension() != extension; });
    // People only where some frame has more than one.
    std::map<std::string, int> people;
    bool numbered = true;
    for (const fs::path& file : files) {
      const auto parts = FrameAndPerson(file.stem().string());
      numbered = numbered && parts;
      if (parts) ++people[parts->first];
    }
    for (const auto& [frame, count] : people) {
      if (numbered) found.people = std::max(found.people, count);
    }
    for (const fs::path& file : files) {
      const std::string stem = file.stem().string();
      const auto parts = FrameAndPerson(stem);
      if (found.people > 1 && parts->second != person) continue;
      found.files.push_back(file);
      frames.push_back(found.people > 1 ? parts->first : stem);
    }
    if (found.files.empty() && !files.empty()) {
      throw no_person(frames.empty() ? "any" : frames[0], static_cast<std::size_t>(found.people));
    }
  }
  if (found.files.empty()) {
    throw Error(folder.string(), "is a folder without files of parameters (.pkl .npz .npy .json)",
                "Give a file, or a folder with one file a frame");
  }
  found.missing = CountMissing(frames);
  return found;
}

}  // namespace holdfast
