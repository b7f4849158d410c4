// SPDX-License-Identifier: MIT
#include "solver/robot_hand/reader_process.h"

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
  void Number(T value) {
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
  const std::string& Bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class Unpacker {
 public:
  explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}
  template <typename T>
  T Number() {
    T value;
    std::memcpy(&value, Take(sizeof value), sizeof value);
    return value;
  }
  std::string Text() {
    const auto size = Number<std::size_t>();
    return {Take(size), size};
  }
  template <typename Matrix>
  void Dense(Matrix& matrix) {
    const auto cols = Number<Eigen::Index>();
    const std::size_t column =
        static_cast<std::size_t>(matrix.rows()) * sizeof(typename Matrix::Scalar);
    if (cols < 0 || static_cast<std::size_t>(cols) > bytes_.size() / column) Fail();
    matrix.resize(Eigen::NoChange, cols);
    const std::size_t size = column * static_cast<std::size_t>(cols);
    if (size > 0) std::memcpy(matrix.data(), Take(size), size);
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

void Pack(const RobotHand& hand, Packer& out) {
  out.Text(hand.name);
  out.Text(hand.source);
  out.Number(hand.links.size());
  for (const RobotLink& link : hand.links) {
    out.Text(link.name);
    out.Number(link.parent);
    out.Text(link.joint);
    out.Number(link.kind);
    out.Dense(link.parent_from_joint.matrix());
    out.Dense(link.axis);
    out.Number(link.dof);
    out.Number(link.factor);
    out.Number(link.offset);
    out.Number(link.shapes.size());
    for (const TriangleMesh& shape : link.shapes) {
      out.Dense(shape.vertices);
      out.Dense(shape.faces);
    }
  }
  out.Number(hand.dofs.size());
  for (const RobotDof& dof : hand.dofs) {
    out.Text(dof.name);
    out.Number(dof.low);
    out.Number(dof.high);
  }
  out.Number(hand.notes.size());
  for (const std::string& note : hand.notes) out.Text(note);
}

RobotHand UnpackHand(Unpacker& in) {
  RobotHand hand;
  hand.name = in.Text();
  hand.source = in.Text();
  for (auto links = in.Number<std::size_t>(); links > 0; --links) {
    RobotLink& link = hand.links.emplace_back();
    link.name = in.Text();
    link.parent = in.Number<int>();
    link.joint = in.Text();
    link.kind = in.Number<RobotJointKind>();
    in.Dense(link.parent_from_joint.matrix());
    in.Dense(link.axis);
    link.dof = in.Number<int>();
    link.factor = in.Number<double>();
    link.offset = in.Number<double>();
    for (auto shapes = in.Number<std::size_t>(); shapes > 0; --shapes) {
      TriangleMesh& shape = link.shapes.emplace_back();
      in.Dense(shape.vertices);
      in.Dense(shape.faces);
    }
  }
  for (auto dofs = in.Number<std::size_t>(); dofs > 0; --dofs) {
    RobotDof& dof = hand.dofs.emplace_back();
    dof.name = in.Text();
    dof.low = in.Number<double>();
    dof.high = in.Number<double>();
  }
  for (auto notes = in.Number<std::size_t>(); notes > 0; --notes) hand.notes.push_back(in.Text());
  return hand;
}

enum class Answer : char { kHand, kError, kMemory, kFault };

// End marker: an answer without it was truncated.
constexpr std::string_view kWhole = "whole";

std::string AnswerOf(const std::function<RobotHand()>& read) {
  Packer out;
  try {
    const RobotHand hand = read();
    out.Number(Answer::kHand);
    Pack(hand, out);
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

struct Child {
  pid_t id = -1;
  int answer = -1;
};

Child Begin(const fs::path& path, const std::function<RobotHand()>& read) {
  const std::scoped_lock lock(LibraryLock());
  std::array<int, 2> ends{};
  Child child;
  if (pipe2(ends.data(), O_CLOEXEC) == 0) {
    child.id = fork();
    if (child.id == 0) {
      close(ends[0]);
      Read(ends[1], read);
    }
    const int why = errno;
    close(ends[1]);
    child.answer = ends[0];
    if (child.id > 0) return child;
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
                "Give a file of the hand alone, with smaller meshes");
  }
  throw Error(path.string(),
              fmt::format("crashes {}{}", library,
                          number != 0 ? fmt::format(" ({})", strsignal(number)) : ""),
              "Check its XML and its meshes in the program that wrote them");
}

}  // namespace

std::mutex& LibraryLock() {
  static std::mutex lock;
  return lock;
}

RobotHand ReadInProcess(const fs::path& path, std::string_view library,
                        const std::function<RobotHand()>& read) {
  const Child child = Begin(path, read);
  std::string bytes;
  const bool in_time = Receive(child.answer, bytes);
  if (!in_time) kill(child.id, SIGKILL);
  close(child.answer);
  int status = 0;
  while (waitpid(child.id, &status, 0) < 0 && errno == EINTR) {
  }
  if (!in_time || !bytes.ends_with(kWhole)) Report(path, library, in_time, status);
  Unpacker in(bytes);
  switch (in.Number<Answer>()) {
    case Answer::kHand:
      return UnpackHand(in);
    case Answer::kError: {
      const std::string where = in.Text(), problem = in.Text(), remedy = in.Text();
      throw Error(where, problem, remedy);
    }
    case Answer::kMemory:
      throw Error(
          path.string(),
          fmt::format("takes {} more than {} MB of memory to read", library, kMemory_bytes >> 20),
          "Give a file of the hand alone, with smaller meshes and images");
    case Answer::kFault:
      break;
  }
  throw Error(path.string(), fmt::format("causes an error in {}: {}", library, in.Text()),
              "Check it in the program that wrote it");
}

}  // namespace holdfast
