// SPDX-License-Identifier: MIT
#include "geometry/jobs/job_owner.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/checksum.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

std::string FirstLine(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

// Host, boot and name spaces of processes and of time since the boot: where a process number, and
// when it began, mean the same process.
std::string ThisMachine() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  std::error_code ignored;
  return Checksum(std::string(host.data()) + ' ' + FirstLine("/proc/sys/kernel/random/boot_id") +
                  ' ' + fs::read_symlink("/proc/self/ns/pid", ignored).string() + ' ' +
                  fs::read_symlink("/proc/self/ns/time", ignored).string());
}

// When a process began, in ticks since the boot; nothing where there is none.
std::optional<std::string> StartOf(long process) {
  const std::string line = FirstLine(fmt::format("/proc/{}/stat", process));
  const std::size_t name_ends = line.rfind(')');
  if (name_ends == line.npos) return std::nullopt;
  std::istringstream fields(line.substr(name_ends + 1));
  std::string state, field;
  fields >> state;
  if (state == "Z" || state == "X") return std::nullopt;  // dead, not yet buried
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

JobOwner::JobOwner(fs::path folder, JobOwnerOptions options)
    : folder_(std::move(folder)), options_(options), machine_(ThisMachine()) {
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
  // Work that was broken off keeps its lock: the next to come sees that its owner is gone.
  std::error_code ignored;
  fs::remove(own_, ignored);
}

void JobOwner::Beat() {
  std::unique_lock guard(lock_);
  while (!ends_.wait_for(guard, std::chrono::duration<double>(options_.beat_s),
                         [this] { return ended_; })) {
    ++beats_;
    try {
      WriteWhole(own_, 0, fmt::format("{} {}\n", id_, beats_));
    } catch (const Error&) {  // a full disk: others may take over, and find what was done
    }
  }
}

fs::path JobOwner::File(const std::string& key, int generation) const {
  return folder_ / fmt::format("lock.{}.{}", Checksum(key), generation);
}

bool JobOwner::Link(const fs::path& lock) const {
  if (::link(own_.c_str(), lock.c_str()) == 0) return true;
  if (errno != EEXIST) {  // no hard links here
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
      throw Error(lock.string(), fmt::format("could not be made ({})", std::strerror(errno)),
                  "Free some space or check the folder's permissions");
    }
  }
  // Over NFS the answer to a link that was made may be lost, and the second try finds it there.
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
  const auto [seen, is_new] = seen_.try_emplace(id, Seen{beat, now});
  if (!is_new && seen->second.beat != beat) seen->second = {beat, now};
  return std::chrono::duration<double>(now - seen->second.since).count() >= options_.dead_after_s;
}

bool JobOwner::TryLock(const std::string& key, bool* took_over) {
  if (took_over != nullptr) *took_over = false;
  for (int generation = 0;; ++generation) {
    const fs::path file = File(key, generation);
    if (Link(file)) {
      // Somebody outbid this very generation while it was gone from sight.
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
    if (owner.empty()) return false;  // removed since, or being written: the next try will tell
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
