// SPDX-License-Identifier: MIT
#include "geometry/robot/reader_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HOLDFAST_SHADOW_MEMORY  // shadow memory fills the address space
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HOLDFAST_SHADOW_MEMORY
#endif
#endif

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr rlim_t kProcessor_s = 20, kMemory_bytes = rlim_t{1} << 30;
constexpr std::chrono::seconds kWall{60};
constexpr std::size_t kMaxAnswer_bytes = std::size_t{1} << 30;

// Serializes numbers, strings and hands. Both ends are this program on this machine.
class Packer {
 public:
  template <typename T>
  void Number(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void Text(std::string_view text) {
    Number(text.size());
    bytes_ += text;
  }
  template <typename Matrix>
  void Dense(const Matrix& matrix) {
    Number(matrix.cols());
    bytes_.append(reinterpret_cast<const char*>(matrix.data()),
                  static_cast<std::size_t>(matrix.size()) * sizeof *matrix.data());
  }
  template <typename T, typename Each>
  void List(const std::vector<T>& items, const Each& each) {
    Number(items.size());
    for (const T& item : items) each(item);
  }
  const std::string& Bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}
  template <typename T>
  void Number(T& value) {
    std::memcpy(&value, Take(sizeof value), sizeof value);
  }
  void Text(std::string& text) {
    std::size_t size = 0;
    Number(size);
    text.assign(Take(size), size);
  }
  template <typename Matrix>
  void Dense(Matrix& matrix) {
    Eigen::Index cols = 0;
    Number(cols);
    const std::size_t column =
        static_cast<std::size_t>(matrix.rows()) * sizeof(typename Matrix::Scalar);
    if (cols < 0 || static_cast<std::size_t>(cols) > bytes_.size() / column) Fail();
    matrix.resize(Eigen::NoChange, cols);
    const std::size_t size = column * static_cast<std::size_t>(cols);
    if (size > 0) std::memcpy(matrix.data(), Take(size), size);
  }
  template <typename T, typename Each>
  void List(std::vector<T>& items, const Each& each) {
    std::size_t count = 0;
    for (Number(count); count > 0; --count) each(items.emplace_back());
  }

 private:
  [[noreturn]] static void Fail() { throw std::runtime_error("the reader's answer is truncated"); }
  const char* Take(std::size_t size) {
    if (size > bytes_.size()) Fail();
    const char* const at = bytes_.data();
    bytes_.remove_prefix(size);
    return at;
  }
  std::string_view bytes_;
};

// Packs a hand, or unpacks one.
template <typename Pack, typename Hand>
void Transmit(Hand& hand, Pack& pack) {
  pack.Text(hand.name);
  pack.Text(hand.source);
  pack.List(hand.links, [&](auto& link) {
    pack.Text(link.name);
    pack.Number(link.parent);
    pack.Text(link.joint);
    pack.Number(link.kind);
    pack.Dense(link.parent_from_joint.matrix());
    pack.Dense(link.axis);
    pack.Number(link.dof);
    pack.Number(link.factor);
    pack.Number(link.offset);
    pack.List(link.shapes, [&](auto& shape) {
      pack.Dense(shape.vertices);
      pack.Dense(shape.faces);
    });
  });
  pack.List(hand.dofs, [&](auto& dof) {
    pack.Text(dof.name);
    pack.Number(dof.low);
    pack.Number(dof.high);
  });
  pack.List(hand.notes, [&](auto& note) { pack.Text(note); });
}

enum class Answer : char { kHand, kError, kMemory, kFault };

// End marker: an answer without it was truncated.
constexpr std::string_view kWhole = "whole";

std::string AnswerOf(const std::function<RobotHand()>& read) {
  Packer out;
  try {
    const RobotHand hand = read();
    out.Number(Answer::kHand);
    Transmit(hand, out);
  } catch (const Error& error) {
    out.Number(Answer::kError);
    for (const std::string& part : {error.Where(), error.Problem(), error.Remedy()}) out.Text(part);
  } catch (const std::bad_alloc&) {
    out = {};
    out.Number(Answer::kMemory);
  } catch (const std::exception& fault) {
    out.Number(Answer::kFault);
    out.Text(fault.what());
  }
  out.Text(kWhole);
  return out.Bytes();
}

void SetLimit(int resource, rlim_t most) {
  rlimit limit{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) return;
  limit.rlim_cur = std::min(limit.rlim_max, most);
  setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

// Runs in the child, which has only this thread.
[[noreturn]] void Read(int answer, const std::function<RobotHand()>& read) {
  for (const int number : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS, SIGILL, SIGTRAP, SIGXCPU}) {
    signal(number, SIG_DFL);
  }
  SetLimit(RLIMIT_CORE, 0);
  SetLimit(RLIMIT_CPU, kProcessor_s);
#ifndef HOLDFAST_SHADOW_MEMORY
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  SetLimit(RLIMIT_AS,
           static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMemory_bytes);
#endif
  const int nowhere = open("/dev/null", O_RDWR);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
  const std::string bytes = AnswerOf(read);
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = write(answer, bytes.data() + sent, bytes.size() - sent);
    if (count < 0 && errno != EINTR) break;
    if (count > 0) sent += static_cast<std::size_t>(count);
  }
  _exit(0);
}

// Reads until end of file. Returns false on timeout, error or an oversized answer.
bool Receive(int from, std::string& bytes) {
  const Clock::time_point end = Clock::now() + kWall;
  std::array<char, 1 << 16> block;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0 || bytes.size() > kMaxAnswer_bytes) return false;
    pollfd waiting{from, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(left.count()));
    if (ready < 0 && errno != EINTR) return false;
    if (ready <= 0) continue;
    const ssize_t count = read(from, block.data(), block.size());
    if (count == 0) return true;
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) bytes.append(block.data(), static_cast<std::size_t>(count));
  }
}

// Returns the child process; `answer`: where its answer is read.
pid_t Begin(const fs::path& path, const std::function<RobotHand()>& read, int& answer) {
  const std::scoped_lock lock(LibraryLock());
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) == 0) {
    const pid_t child = fork();
    if (child == 0) {
      close(ends[0]);
      Read(ends[1], read);
    }
    const int why = errno;
    close(ends[1]);
    answer = ends[0];
    if (child > 0) return child;
    close(ends[0]);
    errno = why;
  }
  throw Error(path.string(),
              fmt::format("is read in a separate process, which cannot be started ({})",
                          std::strerror(errno)),
              "Raise the limit of processes and files (ulimit -u, ulimit -n)");
}

// Throws the Error that explains why there is no answer.
[[noreturn]] void Report(const fs::path& path, std::string_view library, bool in_time, int status) {
  const int number = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (!in_time || number == SIGXCPU || number == SIGKILL) {
    throw Error(path.string(),
                fmt::format("takes {} longer than {} s to read", library, kProcessor_s),
                "Give a file of the hand or object alone, with smaller meshes");
  }
  throw Error(path.string(),
              fmt::format("crashes {}{}", library,
                          number != 0 ? fmt::format(" ({})", strsignal(number)) : ""),
              "Check it and its meshes in the program that wrote them");
}

}  // namespace

std::mutex& LibraryLock() {
  static std::mutex lock;
  return lock;
}

RobotHand ReadInProcess(const fs::path& path, std::string_view library,
                        const std::function<RobotHand()>& read) {
  int from = -1;
  const pid_t child = Begin(path, read, from);
  std::string bytes;
  const bool in_time = Receive(from, bytes);
  if (!in_time) kill(child, SIGKILL);
  close(from);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time || !bytes.ends_with(kWhole)) Report(path, library, in_time, status);
  Unpacker in(bytes);
  Answer answer = Answer::kFault;
  in.Number(answer);
  switch (answer) {
    case Answer::kHand: {
      RobotHand hand;
      Transmit(hand, in);
      return hand;
    }
    case Answer::kError: {
      std::string where, problem, remedy;
      for (std::string* text : {&where, &problem, &remedy}) in.Text(*text);
      throw Error(where, problem, remedy);
    }
    case Answer::kMemory:
      throw Error(
          path.string(),
          fmt::format("takes {} more than {} MB of memory to read", library, kMemory_bytes >> 20),
          "Give a file of the hand or object alone, with smaller meshes and images");
    case Answer::kFault:
      break;
  }
  std::string fault;
  in.Text(fault);
  throw Error(path.string(), fmt::format("causes an error in {}: {}", library, fault),
              "Check it in the program that wrote it");
}

}  // namespace holdfast
