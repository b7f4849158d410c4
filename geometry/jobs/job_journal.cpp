// SPDX-License-Identifier: MIT
#include "geometry/jobs/job_journal.h"

#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/json_file.h"

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
        std::ranges::find_if(files_, [&](const auto& file) { return file.first == entry.path(); });
    const auto index = static_cast<std::uint32_t>(known - files_.begin());
    if (known == files_.end()) files_.emplace_back(entry.path(), 0);
    std::error_code gone;
    const std::uintmax_t size = entry.file_size(gone);
    if (!gone && size > files_[index].second) ReadOn(index);
  }
}

void JobJournal::ReadOn(std::uint32_t index) {
  auto& [path, read_bytes] = files_[index];
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(read_bytes));
  for (std::string text; std::getline(in, text) && !in.eof();) {  // no newline: still incomplete
    const std::uint64_t offset = read_bytes;
    read_bytes += text.size() + 1;
    const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
    if (!line.is_object()) continue;
    try {
      JobStatus status{
          line.at("hash"), line.at("status") == "done", line.at("exit_code"), line.at("try"), index,
          offset};
      JobStatus& last = jobs_[line.at("name")];
      if (status.tries >= last.tries) last = std::move(status);
    } catch (const nlohmann::json::exception&) {  // not a status line
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
    path = files_[status.file].first;
  }
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(status.offset));
  std::string text;
  std::getline(in, text);
  const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
  if (!line.is_object()) {
    throw Error(path.string(), "is damaged", "Delete it: its jobs are run again");
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
  // NFS shows a line to other clients only after the file is closed.
  const int file = ::open(own_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const ssize_t written = file < 0 ? -1 : ::write(file, text.data(), text.size());
  const int reason = written < 0 ? errno : ENOSPC;
  const bool closed = file >= 0 && ::close(file) == 0;
  if (written != static_cast<ssize_t>(text.size()) || !closed) {
    throw Error(own_.string(), fmt::format("could not be written ({})", std::strerror(reason)),
                "Free some space and start again: finished jobs are kept");
  }
  auto known = std::ranges::find_if(files_, [&](const auto& f) { return f.first == own_; });
  if (known == files_.end()) known = files_.insert(files_.end(), {own_, 0});
  ReadOn(static_cast<std::uint32_t>(known - files_.begin()));
}

namespace {

std::string FirstLine(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

// Hash of the host, the boot and the namespaces of process IDs and of time since boot. Where it is
// equal, a process ID and a start time identify the same process.
std::string ThisMachine() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  std::error_code ignored;
  return Checksum(std::string(host.data()) + ' ' + FirstLine("/proc/sys/kernel/random/boot_id") +
                  ' ' + fs::read_symlink("/proc/self/ns/pid", ignored).string() + ' ' +
                  fs::read_symlink("/proc/self/ns/time", ignored).string());
}

// Start time of a process in clock ticks since boot; nullopt if no such process is alive.
std::optional<std::string> StartOf(long process) {
  const std::string line = FirstLine(fmt::format("/proc/{}/stat", process));
  const std::size_t name_ends = line.rfind(')');
  if (name_ends == line.npos) return std::nullopt;
  std::istringstream fields(line.substr(name_ends + 1));
  std::string state, field;
  fields >> state;
  if (state == "Z" || state == "X") return std::nullopt;  // zombie or dead
  for (int k = 4; k <= 22; ++k) fields >> field;
  return field;
}

void WriteWhole(const fs::path& path, int flags, const std::string& text) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0644);
  const bool opened = file >= 0;
  const bool written =
      opened && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int reason = errno;
  const bool closed = opened && ::close(file) == 0;
  if (!written || !closed) {
    throw Error(path.string(),
                fmt::format("could not be written ({})", std::strerror(written ? errno : reason)),
                "Free some space or choose another folder");
  }
}

}  // namespace

JobOwner::JobOwner(fs::path folder, double dead_after_s)
    : folder_(std::move(folder)), dead_after_s_(dead_after_s), machine_(ThisMachine()) {
  const long process = ::getpid();
  static int instances = 0;
  static std::mutex counting;
  const std::lock_guard guard(counting);
  id_ = fmt::format("{}-{}-{}-{}", machine_, process, StartOf(process).value_or("0"), instances++);
  own_ = folder_ / ("owner." + id_);
  WriteWhole(own_, O_EXCL, id_ + " 0\n");
  heart_ = std::thread([this] { Beat(); });
}

JobOwner::~JobOwner() {
  {
    const std::lock_guard guard(lock_);
    ended_ = true;
  }
  ends_.notify_all();
  heart_.join();
  // An interrupted job keeps its lock: the next process sees that the owner is gone.
  std::error_code ignored;
  fs::remove(own_, ignored);
}

void JobOwner::Beat() {
  constexpr std::chrono::seconds kBetweenBeats(5);
  std::unique_lock guard(lock_);
  while (!ends_.wait_for(guard, kBetweenBeats, [this] { return ended_; })) {
    ++beats_;
    try {
      WriteWhole(own_, 0, fmt::format("{} {}\n", id_, beats_));
    } catch (const Error&) {  // full disk: others may take over and find the work done
    }
  }
}

fs::path JobOwner::File(const std::string& key, int generation) const {
  return folder_ / fmt::format("lock.{}.{}", Checksum(key), generation);
}

bool JobOwner::Link(const fs::path& lock) const {
  if (::link(own_.c_str(), lock.c_str()) == 0) return true;
  if (errno != EEXIST) {  // no hard links on this file system
    const int file = ::open(lock.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (file >= 0) {
      const std::string text = id_ + " 0\n";
      const bool written =
          ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
      const bool closed = ::close(file) == 0;
      if (written && closed) return true;
      ::unlink(lock.c_str());
    }
    if (errno != EEXIST) {
      throw Error(lock.string(), fmt::format("could not be created ({})", std::strerror(errno)),
                  "Free some space or check the folder's permissions");
    }
  }
  // Over NFS the reply to a successful link() may be lost; the retry then finds the link there.
  return FirstLine(lock).starts_with(id_ + ' ');
}

bool JobOwner::IsDead(const std::string& id) {
  if (id == id_) return false;
  std::istringstream parts(id);
  std::string machine, process, start;
  std::getline(parts, machine, '-');
  std::getline(parts, process, '-');
  std::getline(parts, start, '-');
  if (machine == machine_) {
    const std::optional<std::string> begun = StartOf(std::strtol(process.c_str(), nullptr, 10));
    return !begun || *begun != start ||
           (::getpid() == std::strtol(process.c_str(), nullptr, 10) &&
            !fs::exists(folder_ / ("owner." + id)));
  }
  const std::string beat = FirstLine(folder_ / ("owner." + id));
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard guard(lock_);
  auto& [last_beat, since] = seen_.try_emplace(id, beat, now).first->second;
  if (last_beat != beat) {
    last_beat = beat;
    since = now;
  }
  return std::chrono::duration<double>(now - since).count() >= dead_after_s_;
}

bool JobOwner::TryLock(const std::string& key, bool* took_over) {
  if (took_over != nullptr) *took_over = false;
  for (int generation = 0;; ++generation) {
    const fs::path file = File(key, generation);
    if (Link(file)) {
      // Another process superseded this generation while its file was not visible.
      std::error_code ignored;
      if (fs::exists(File(key, generation + 1), ignored)) {
        fs::remove(file, ignored);
        return false;
      }
      if (took_over != nullptr) *took_over = generation > 0;
      const std::lock_guard guard(lock_);
      held_[key] = generation;
      return true;
    }
    const std::string line = FirstLine(file);
    const std::string owner = line.substr(0, line.find(' '));
    if (owner.empty()) return false;  // removed or being written: the next try decides
    std::error_code ignored;
    if (fs::exists(File(key, generation + 1), ignored)) continue;
    if (!IsDead(owner)) return false;
  }
}

void JobOwner::Unlock(const std::string& key) {
  int generation = 0;
  {
    const std::lock_guard guard(lock_);
    const auto held = held_.find(key);
    if (held == held_.end()) return;
    generation = held->second;
    held_.erase(held);
  }
  std::error_code ignored;
  for (; generation >= 0; --generation) fs::remove(File(key, generation), ignored);
}

void JobOwner::RemoveDead() {
  std::error_code ignored;
  std::vector<fs::path> gone;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored)) {
    const std::string name = entry.path().filename().string();
    const bool is_owner = name.starts_with("owner."), is_lock = name.starts_with("lock.");
    if (!is_owner && !is_lock) continue;
    const std::string line = FirstLine(entry.path());
    if (IsDead(line.substr(0, line.find(' ')))) gone.push_back(entry.path());
  }
  for (const fs::path& path : gone) fs::remove(path, ignored);
}

}  // namespace holdfast
