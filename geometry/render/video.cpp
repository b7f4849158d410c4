// SPDX-License-Identifier: MIT
#include "geometry/render/video.h"

#include <sys/socket.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/text_scanner.h"

extern char** environ;

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr int kPaletteFrames = 12;

// Thrown to leave WriteAtomically without a file and without an error.
struct Stopped {};

std::vector<std::string> Arguments(const fs::path& output, VideoFormat format, const Image& first,
                                   double frame_rate, int palette_frames) {
  // "file:" protects names with a colon or a leading dash. Bit-exact flags and a fixed number of
  // threads make the output deterministic.
  std::vector<std::string> arguments = {
      "-hide_banner",
      "-nostdin",
      "-loglevel",
      "error",
      "-y",
      "-f",
      "rawvideo",
      "-pixel_format",
      "rgb24",
      "-video_size",
      fmt::format("{}x{}", first.width, first.height),
      "-framerate",
      fmt::format("{:.6f}", frame_rate),
      "-i",
      "pipe:0",
      "-map_metadata",
      "-1",
      "-fflags",
      "+bitexact",
      "-flags",
      "+bitexact",
      "-threads",
      "4",
  };
  const auto add = [&](std::initializer_list<std::string> more) {
    arguments.insert(arguments.end(), more);
  };
  if (format == VideoFormat::kMp4) {
    add({"-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p", "-colorspace", "bt709",
         "-color_primaries", "bt709", "-color_trc", "bt709", "-c:v", "libx264", "-preset", "medium",
         "-crf", "18", "-movflags", "+faststart", "-f", "mp4"});
  } else {
    // The frames for the palette come first and are not shown.
    add({"-filter_complex",
         fmt::format("split[a][b];[a]trim=end_frame={0},palettegen=stats_mode=full[palette];"
                     "[b]trim=start_frame={0},setpts=PTS-STARTPTS[shown];"
                     "[shown][palette]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle",
                     palette_frames),
         "-loop", "0", "-f", "gif"});
  }
  arguments.push_back("file:" + output.string());
  return arguments;
}

void Require(const fs::path& path, VideoFormat format, int num_frames, double frame_rate) {
  if (num_frames < 1) {
    throw Error(path.string(), "has no frames", "Give a clip of at least one frame");
  }
  if (!(frame_rate > 0.0) || !std::isfinite(frame_rate)) {
    throw Error(path.string(), fmt::format("cannot have a frame rate of {}", frame_rate),
                "Give the frames per second");
  }
  if (format == VideoFormat::kGif && frame_rate > kMaxGifRate) {
    throw Error(path.string(), fmt::format("cannot have {:g} frames per second", frame_rate),
                fmt::format("Use at most {:g} for a .gif", kMaxGifRate));
  }
}

constexpr std::size_t kShownLines = 4;
constexpr long kReadBack = 4096;

// The last lines of a log, joined into one.
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
  return joined.empty() ? "no error message" : joined;
}

Error CannotStart(int reason) {
  if (reason == ENOENT) {
    return Error("ffmpeg", "is not installed, but is needed to write .mp4 and .gif files",
                 "Install the package ffmpeg, or write pictures (-o frame_%03d.png)");
  }
  return Error("ffmpeg", fmt::format("cannot be started ({})", std::strerror(reason)),
               "Check that the program ffmpeg in PATH runs");
}

// An ffmpeg process that reads from this process. It has its own process group, so that Ctrl-C does
// not reach it. It is terminated if destroyed before Finish().
class FfmpegProcess {
 public:
  // Starts `ffmpeg arguments...`. Throws Error if it is not installed or cannot be started.
  explicit FfmpegProcess(const std::vector<std::string>& arguments) {
    said_.reset(std::tmpfile());
    // A socket instead of a pipe: a write after ffmpeg has exited gives an error, not SIGPIPE.
    int ends[2];
    if (!said_ || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      throw CannotStart(errno);
    }
    input_ = ends[0];

    std::vector<char*> argv;
    std::string name = "ffmpeg";
    argv.push_back(name.data());
    for (const std::string& argument : arguments)
      argv.push_back(const_cast<char*>(argument.c_str()));
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
  ~FfmpegProcess() {
    if (process_ >= 0) {
      ::kill(process_, SIGKILL);
      Wait();
    }
    if (input_ >= 0) ::close(input_);
  }
  FfmpegProcess(const FfmpegProcess&) = delete;
  FfmpegProcess& operator=(const FfmpegProcess&) = delete;

  // Sends bytes. Throws Error, with ffmpeg's output, if it has exited.
  void Write(std::span<const std::uint8_t> bytes) {
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

  // Closes the input and waits for exit. Throws Error, with ffmpeg's output, if it failed.
  void Finish() {
    ::close(input_);
    input_ = -1;
    const int status = Wait();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) Fail();
  }

 private:
  [[noreturn]] void Fail() {
    throw Error("ffmpeg", fmt::format("failed ({})", LastLines(said_.get())),
                "Check the installed ffmpeg (it needs libx264 for .mp4), and the free space");
  }

  int Wait() {
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return status;
  }

  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, CloseFile> said_;  // its stderr
  int input_ = -1;                              // our end of its stdin
  pid_t process_ = -1;
};

}  // namespace

std::optional<VideoFormat> VideoFormatOf(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (EqualIgnoringCase(extension, ".mp4")) return VideoFormat::kMp4;
  if (EqualIgnoringCase(extension, ".gif")) return VideoFormat::kGif;
  return std::nullopt;
}

int FramesRequested(VideoFormat format, int num_frames) {
  return num_frames + (format == VideoFormat::kGif ? std::min(kPaletteFrames, num_frames) : 0);
}

bool WriteVideo(const fs::path& path, int num_frames, double frame_rate, int batch,
                const std::function<std::vector<Image>(std::span<const int>)>& draw) {
  const std::optional<VideoFormat> format = VideoFormatOf(path);
  if (!format) {
    throw Error(path.string(), "is not the name of a video", "Give a name in .mp4 or .gif");
  }
  Require(path, *format, num_frames, frame_rate);

  std::vector<int> order;
  const int palette_frames = FramesRequested(*format, num_frames) - num_frames;
  for (int k = 0; k < palette_frames; ++k) {
    order.push_back(palette_frames == 1 ? 0 : k * (num_frames - 1) / (palette_frames - 1));
  }
  for (int k = 0; k < num_frames; ++k) order.push_back(k);

  const auto encode = [&](const fs::path& temporary) {
    std::optional<FfmpegProcess> ffmpeg;
    int width = 0, height = 0;
    for (std::size_t begin = 0; begin < order.size();) {
      const std::size_t count = std::min(order.size() - begin, std::size_t(std::max(1, batch)));
      const std::vector<Image> images = draw({order.data() + begin, count});
      if (images.size() != count) throw Stopped();
      for (const Image& image : images) {
        if (!ffmpeg) {
          width = image.width;
          height = image.height;
          if (*format == VideoFormat::kMp4 && (width % 2 != 0 || height % 2 != 0)) {
            throw Error(path.string(), fmt::format("cannot have {} x {} pixels", width, height),
                        "Use an even width and height for an .mp4");
          }
          ffmpeg.emplace(Arguments(temporary, *format, image, frame_rate, palette_frames));
        }
        if (image.width != width || image.height != height) {
          throw Error(path.string(), "its frames differ in size", "Draw them in one size");
        }
        ffmpeg->Write(image.rgb);
      }
      begin += count;
    }
    ffmpeg->Finish();
  };
  try {
    WriteAtomically(path, encode);
  } catch (const Stopped&) {
    return false;
  }
  return true;
}

}  // namespace holdfast
