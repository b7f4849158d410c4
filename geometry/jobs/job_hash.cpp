// SPDX-License-Identifier: MIT
#include "geometry/jobs/job_hash.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/checksum.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostSeen = 4096;

// Of a folder: names and contents, in the order of the names. Hidden files are somebody's work in
// progress.
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

// No file: the word itself.
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
  if (seen_.size() >= kMostSeen) seen_.clear();
  return seen_[word] = *content;
}

std::string JobHasher::Hash(std::span<const std::string> words) {
  std::string text = common_;
  for (const std::string& word : words) text += Meaning(word) + '\0';
  return Checksum(text);
}

}  // namespace holdfast
