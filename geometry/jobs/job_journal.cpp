// SPDX-License-Identifier: MIT
#include "geometry/jobs/job_journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_text.h"

namespace holdfast {

namespace fs = std::filesystem;

JobJournal::JobJournal(fs::path folder, const std::string& owner)
    : folder_(std::move(folder)), own_(folder_ / fmt::format("status.{}.jsonl", owner)) {
  Refresh();
}

void JobJournal::Refresh() {
  const std::lock_guard guard(lock_);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("status.") || !name.ends_with(".jsonl")) continue;
    const auto known =
        std::ranges::find_if(files_, [&](const File& file) { return file.path == entry.path(); });
    const auto index = static_cast<std::uint32_t>(known - files_.begin());
    if (known == files_.end()) files_.push_back({entry.path(), 0});
    std::error_code gone;
    const std::uintmax_t size = entry.file_size(gone);
    if (!gone && size > files_[index].read) ReadOn(index);
  }
}

void JobJournal::ReadOn(std::uint32_t index) {
  File& file = files_[index];
  std::ifstream in(file.path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(file.read));
  for (std::string text; std::getline(in, text) && !in.eof();) {  // no end of line: not whole yet
    const std::uint64_t offset = file.read;
    file.read += text.size() + 1;
    const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
    if (!line.is_object()) continue;
    try {
      JobStatus status{
          line.at("hash"), line.at("status") == "done", line.at("exit_code"), line.at("try"), index,
          offset};
      JobStatus& last = jobs_[line.at("name")];
      if (status.tries >= last.tries) last = std::move(status);
    } catch (const nlohmann::json::exception&) {  // no line of ours
    }
  }
}

std::optional<JobStatus> JobJournal::Find(const std::string& name) const {
  const std::lock_guard guard(lock_);
  const auto found = jobs_.find(name);
  if (found == jobs_.end()) return std::nullopt;
  return found->second;
}

nlohmann::json JobJournal::Line(const JobStatus& status) const {
  fs::path path;
  {
    const std::lock_guard guard(lock_);
    path = files_[status.file].path;
  }
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(status.offset));
  std::string text;
  std::getline(in, text);
  const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
  if (!line.is_object()) {
    throw Error(path.string(), "is damaged", "Delete it: its jobs are done again");
  }
  return line;
}

void JobJournal::Append(const std::string& name, const std::string& hash, bool done, int exit_code,
                        nlohmann::json line) {
  const std::lock_guard guard(lock_);
  const auto before = jobs_.find(name);
  line["name"] = name;
  line["hash"] = hash;
  line["status"] = done ? "done" : "failed";
  line["exit_code"] = exit_code;
  line["try"] = before == jobs_.end() ? 1 : before->second.tries + 1;
  const std::string text = JsonText(line) + "\n";
  // Closed after each line: that is when NFS shows it to others.
  const int file = ::open(own_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const ssize_t written = file < 0 ? -1 : ::write(file, text.data(), text.size());
  const int reason = written < 0 ? errno : ENOSPC;
  const bool closed = file >= 0 && ::close(file) == 0;
  if (written != static_cast<ssize_t>(text.size()) || !closed) {
    throw Error(own_.string(), fmt::format("could not be written ({})", std::strerror(reason)),
                "Free some space and start again: what is done stays done");
  }
  auto known = std::ranges::find_if(files_, [&](const File& f) { return f.path == own_; });
  if (known == files_.end()) known = files_.insert(files_.end(), {own_, 0});
  ReadOn(static_cast<std::uint32_t>(known - files_.begin()));
}

}  // namespace holdfast
