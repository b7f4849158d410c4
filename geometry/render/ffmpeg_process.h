// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace holdfast {

/// The program ffmpeg, reading from us. It is in a process group of its own: Ctrl-C reaches us and
/// not it. Destroyed before Finish(), it is ended.
class FfmpegProcess {
 public:
  /// Starts `ffmpeg arguments...`. Throws Error when it is not installed or cannot be started.
  explicit FfmpegProcess(const std::vector<std::string>& arguments);
  ~FfmpegProcess();
  FfmpegProcess(const FfmpegProcess&) = delete;
  FfmpegProcess& operator=(const FfmpegProcess&) = delete;

  /// Hands it bytes. Throws Error, with what it said, when it has ended.
  void Write(std::span<const std::uint8_t> bytes);

  /// Says that there is no more, and waits for its end. Throws Error, with what it said, when it
  /// failed.
  void Finish();

 private:
  [[noreturn]] void Fail();
  int Wait();

  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, CloseFile> said_;  // its stderr
  int input_ = -1;                              // our end of its stdin
  pid_t process_ = -1;
};

}  // namespace holdfast
