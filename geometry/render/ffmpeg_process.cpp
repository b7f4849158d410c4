// SPDX-License-Identifier: MIT
#include "geometry/render/ffmpeg_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include "geometry/error.h"

extern char** environ;

namespace holdfast {
namespace {

constexpr std::size_t kShownLines = 4;
constexpr long kReadBack = 4096;

// The last lines of a log, joined to one.
std::string LastLines(std::FILE* file) {
  std::fflush(file);
  std::fseek(file, 0, SEEK_END);
  const long size = std::ftell(file);
  std::fseek(file, std::max(0L, size - kReadBack), SEEK_SET);
  std::string text(static_cast<std::size_t>(std::min(size, kReadBack)), '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n' || c == '\r') {
      if (!lines.back().empty()) lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  if (lines.back().empty()) lines.pop_back();
  std::string joined;
  for (std::size_t k = lines.size() > kShownLines ? lines.size() - kShownLines : 0;
       k < lines.size(); ++k) {
    joined += (joined.empty() ? "" : "; ") + lines[k];
  }
  return joined.empty() ? "it said nothing" : joined;
}

Error CannotStart(int reason) {
  if (reason == ENOENT) {
    return Error("ffmpeg", "is not installed: it is what makes .mp4 and .gif files",
                 "Install the package ffmpeg, or write pictures (-o frame_%03d.png)");
  }
  return Error("ffmpeg", fmt::format("cannot be started ({})", std::strerror(reason)),
               "Check that the program ffmpeg in PATH runs");
}

}  // namespace

FfmpegProcess::FfmpegProcess(const std::vector<std::string>& arguments) {
  said_.reset(std::tmpfile());
  // A socket in place of a pipe: a write to a program that has ended is an error, not SIGPIPE.
  int ends[2];
  if (!said_ || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw CannotStart(errno);
  }
  input_ = ends[0];

  std::vector<char*> argv;
  std::string name = "ffmpeg";
  argv.push_back(name.data());
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ::fileno(said_.get()), STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int failed =
      ::posix_spawnp(&process_, "ffmpeg", &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failed != 0) {
    process_ = -1;
    ::close(input_);
    throw CannotStart(failed);
  }
}

FfmpegProcess::~FfmpegProcess() {
  if (process_ >= 0) {
    ::kill(process_, SIGKILL);
    Wait();
  }
  if (input_ >= 0) ::close(input_);
}

int FfmpegProcess::Wait() {
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return status;
}

void FfmpegProcess::Fail() {
  throw Error("ffmpeg", fmt::format("failed ({})", LastLines(said_.get())),
              "Check the installed ffmpeg (it needs libx264 for .mp4), and the free space");
}

void FfmpegProcess::Write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(input_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0) {
      if (errno == EINTR) continue;
      Wait();
      Fail();
    }
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

void FfmpegProcess::Finish() {
  ::close(input_);
  input_ = -1;
  const int status = Wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) Fail();
}

}  // namespace holdfast
