// SPDX-License-Identifier: MIT
#include "solver/evaluation/listed_reaches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "generator/wandr/intention.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "solver/reach/walk_and_reach.h"

namespace holdfast {
namespace {

constexpr std::string_view kListHead = "clip,frame,ahead,left,up";

ListedReach ListedReachOf(std::string_view line, const std::filesystem::path& root,
                          const std::string& where) {
  const Error fault(where, "is not a clip and four numbers",
                    fmt::format("Give {}: frame from 0, meters", kListHead));
  std::array<std::string_view, 5> cells;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const std::size_t comma = k + 1 < cells.size() ? line.find(',') : line.size();
    if (comma == std::string_view::npos) throw fault;
    cells[k] = line.substr(0, comma);
    line.remove_prefix(std::min(line.size(), comma + 1));
  }
  std::array<double, 4> numbers = {};
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    if (!ParseNumber(cells[k + 1], numbers[k]) || !std::isfinite(numbers[k])) throw fault;
  }
  if (numbers[0] < 0.0 || numbers[0] > 1e6 || numbers[0] != std::floor(numbers[0])) throw fault;
  ListedReach listed{root / std::string(cells[0]),
                     static_cast<int>(numbers[0]),
                     {numbers[1], numbers[2], numbers[3]}};
  if (cells[0].empty() || !std::filesystem::is_regular_file(listed.clip)) {
    throw Error(where, "names a clip that is not there: " + listed.clip.string(),
                "Give the folder that its clips are named from");
  }
  return listed;
}

}  // namespace

std::vector<ListedReach> ReadListedReaches(const std::filesystem::path& table,
                                           const std::filesystem::path& root) {
  constexpr std::size_t kMaxBytes = 16u << 20;
  const std::string text = ByteSource(table).Text(kMaxBytes);
  std::vector<ListedReach> listed;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    const std::string where = fmt::format("{}:{}", table.string(), ++number);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) continue;
    if (number > 1) {
      listed.push_back(ListedReachOf(line, root, where));
    } else if (line != kListHead) {
      throw Error(where, fmt::format("is not '{}'", kListHead), "Begin the table with that line");
    }
  }
  if (listed.empty()) throw Error(table.string(), "lists no reach", "Give a line for each");
  return listed;
}

ListedMotion MakeListedReach(const ListedReach& listed,
                             const std::shared_ptr<const BodyModel>& body,
                             const wandr::NetworkWeights& network, const ReachOptions& options) {
  constexpr double kRestsWithin = 0.02;  // meters
  constexpr Eigen::Index kRestFrames = 15;
  ImportFileOptions import;
  import.parameters.body = body;
  LoadedClip loaded = LoadClip(listed.clip, std::move(import));
  const ReachPerson person =
      PersonInClip(std::move(loaded.clip), loaded.body, listed.frame, listed.clip.string());
  const wandr::Pose<double> pose = wandr::PoseOf<double>(person.states.rightCols<1>());
  const Eigen::Vector3d forward = wandr::HeadingOf<double>(pose.rotation[0]).Forward();
  const Eigen::Vector3d left(-forward.y(), forward.x(), 0.0), &by = listed.ahead_left_up;
  ListedMotion made;
  made.goal = person.Pelvis() + by.x() * forward + by.y() * left;
  made.goal.z() = by.z();
  const std::vector<Eigen::Vector3d> goals = {made.goal};
  const ReachReport report = WalkAndReach(person, network, goals, options);
  if (report.status != ReachStatus::kMade) {
    throw Error(listed.clip.string(), "the motion stops being numbers", "Try other weights");
  }
  const ReachMotion& best = report.motions.front();
  made.clip = ClipOf(best, person);
  made.reached = best.sample.NumReached() == 1;
  const Eigen::MatrixXf& joints = best.sample.track.joints;
  made.rests = joints.cols() >= kRestFrames;
  for (Eigen::Index f = std::max<Eigen::Index>(0, joints.cols() - kRestFrames); f < joints.cols();
       ++f) {
    const Eigen::Vector3d wrist =
        joints.block<3, 1>(3 * WristJoint(options.side), f).cast<double>();
    made.rests = made.rests && (wrist - made.goal).norm() < kRestsWithin;
  }
  return made;
}

}  // namespace holdfast
