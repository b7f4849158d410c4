// SPDX-License-Identifier: MIT
#include "solver/markers/marker_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <tuple>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kArmWeight = 0.3;  // of markers that move relative to the trunk
constexpr double kBothSides_m = 0.25;
// Along +axis, or against it.
UpAxis UpAlong(int axis, bool positive) {
  return static_cast<UpAxis>(2 * axis + (positive ? 0 : 1));
}

bool OfTrunk(int joint) {
  for (const int j :
       {kPelvis, kSpine1, kSpine2, kSpine3, kNeck, kLeftCollar, kRightCollar, kHead}) {
    if (joint == j) return true;
  }
  return false;
}

// Marker positions on a body with forearms forward and in the recording. Markers with the same
// nominal position are merged.
struct Pairs {
  std::vector<Eigen::Vector3d> rest, seen;
  std::vector<double> weight;
};

Pairs PairsOf(const MarkedPerson& person, const std::vector<int>& marker,
              const Eigen::Matrix3Xd& place, bool trunk_alone) {
  std::map<std::tuple<double, double, double>, std::pair<Eigen::Vector4d, int>> all;
  for (std::size_t k = 0; k < marker.size(); ++k) {
    const int joint = person.body.joint[marker[k]];
    if (trunk_alone && !OfTrunk(joint)) continue;
    const Eigen::Vector3d usual = person.bent.col(marker[k]);
    all.try_emplace({usual.x(), usual.y(), usual.z()}, Eigen::Vector4d::Zero(), joint)
        .first->second.first += place.col(k).homogeneous();
  }
  Pairs pairs;
  for (const auto& [usual, value] : all) {
    pairs.seen.push_back(value.first.hnormalized());
    pairs.rest.emplace_back(std::get<0>(usual), std::get<1>(usual), std::get<2>(usual));
    pairs.weight.push_back(OfTrunk(value.second) ? 1.0 : kArmWeight);
  }
  return pairs;
}

Eigen::Vector3d Mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

// Lateral extent on the body.
double WidthOf(const Pairs& pairs) {
  if (pairs.rest.empty()) return 0.0;
  const auto [right, left] =
      std::ranges::minmax(pairs.rest, {}, [](const Eigen::Vector3d& place) { return place.x(); });
  return left.x() - right.x();
}

// Alignment of that body with the markers.
struct BodyFit {
  Eigen::Matrix3d rotation;  // body to recording
  double thickness;  // smallest by largest singular value of the covariance; negative: mirrored
};

// Returns nothing if there are too few markers.
std::optional<BodyFit> FitBody(const Pairs& pairs) {
  if (pairs.rest.size() < 3) return std::nullopt;
  const Eigen::Vector3d rest = Mean(pairs.rest), seen = Mean(pairs.seen);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < pairs.rest.size(); ++k) {
    sum += pairs.weight[k] * (pairs.seen[k] - seen) * (pairs.rest[k] - rest).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> squares(sum.transpose() * sum,
                                                               Eigen::EigenvaluesOnly);
  const Eigen::Vector3d size2 = squares.eigenvalues();  // ascending
  if (size2(1) < 1e-4 * size2(2)) return std::nullopt;  // collinear
  const double thickness = std::sqrt(std::max(0.0, size2(0)) / size2(2));
  return BodyFit{NearestRotation(sum), std::copysign(thickness, sum.determinant())};
}

Eigen::Matrix3d WorldFrom(UpAxis up) {
  Eigen::Matrix3d R;
  switch (up) {
    case UpAxis::kZ:
      return Eigen::Matrix3d::Identity();
    case UpAxis::kY:  // (x, y, z) -> (x, -z, y)
      R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
      return R;
    case UpAxis::kX:  // -> (y, z, x)
      R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
      return R;
    case UpAxis::kMinusZ:  // -> (x, -y, -z)
      R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
      return R;
    case UpAxis::kMinusY:  // -> (x, z, -y)
      R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      return R;
    case UpAxis::kMinusX:
      break;
  }
  R << 0, -1, 0, 0, 0, 1, -1, 0, 0;
  return R;
}

}  // namespace

double ScaleBySize(const MarkerRecording& recording) {
  std::vector<double> sizes;
  const int step = std::max(1, recording.NumFrames() / 50);
  for (int t = 0; t < recording.NumFrames(); t += step) {
    Eigen::AlignedBox3d box;
    int seen = 0;
    for (int m = 0; m < recording.NumMarkers(); ++m) {
      if (!recording.Seen(m, t)) continue;
      box.extend(recording.At(m, t));
      ++seen;
    }
    if (seen > 1) sizes.push_back(box.diagonal().norm());
  }
  if (sizes.empty()) return 1.0;
  std::ranges::nth_element(sizes, sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2));
  const double size = sizes[sizes.size() / 2];
  return size > 50.0 ? 1e-3 : size < 0.005 ? 1e3 : 1.0;
}

MarkerWorld FindWorld(const MarkedPerson& person, const MarkerRecording& recording,
                      const std::vector<int>& column, std::optional<UpAxis> up,
                      const std::string& where) {
  MarkerWorld world;
  Eigen::Vector3d body_up = Eigen::Vector3d::Zero(), trunk_up = Eigen::Vector3d::Zero();
  std::vector<Pairs> frames;
  double thickness = 0.0;
  const int step = std::max(1, recording.NumFrames() / 50);
  for (int t = 0; t < recording.NumFrames(); t += step) {
    std::vector<int> marker;
    Eigen::Matrix3Xd place(3, static_cast<Eigen::Index>(column.size()));
    for (std::size_t k = 0; k < column.size(); ++k) {
      if (column[k] < 0 || !recording.Seen(column[k], t)) continue;
      place.col(marker.size()) = recording.At(column[k], t);
      marker.push_back(static_cast<int>(k));
    }
    frames.push_back(PairsOf(person, marker, place, false));
    const auto whole = FitBody(frames.back());
    if (whole) thickness += whole->thickness;
    if (whole) body_up += whole->rotation.col(1);
    const Pairs of_trunk = PairsOf(person, marker, place, true);
    if (WidthOf(of_trunk) <= kBothSides_m) continue;
    if (const auto trunk = FitBody(of_trunk)) trunk_up += trunk->rotation.col(1);
  }
  // Arms may be anywhere, even overhead: if the whole body is upside down, a trunk with markers on
  // both sides decides.
  if (body_up.maxCoeff() < -body_up.minCoeff() && trunk_up.maxCoeff() > -trunk_up.minCoeff()) {
    body_up = trunk_up;
  }
  if (!body_up.isZero()) {
    int axis = 0;
    body_up.cwiseAbs().maxCoeff(&axis);
    const auto found = UpAlong(axis, body_up(axis) > 0.0);
    if (!up && body_up(axis) < 0.0 && thickness < 0.0) {
      throw Error(where,
                  "is mirrored: left and right are swapped in the names, or an axis is flipped",
                  "Swap L and R in the names, or export with right-handed axes");
    }
    if (!up && body_up(axis) < 0.0) {
      throw Error(
          where,
          fmt::format("shoulders and trunk are upside down along {}, or names are exchanged",
                      UpAxisName(UpAlong(axis, true))),
          fmt::format("Give --up {} if that axis points to the ground",
                      UpAxisName(UpAlong(axis, false))));
    }
    world.up = up.value_or(found);
  } else {
    world.up = up.value_or(UpAxis::kZ);
  }
  world.world_from_recording = WorldFrom(world.up);
  // The rotation about the vertical that best aligns the body with the markers.
  double sine = 0.0, cosine = 0.0;
  for (const Pairs& pairs : frames) {
    if (pairs.rest.empty()) continue;
    const Eigen::Vector3d rest = Mean(pairs.rest), seen = Mean(pairs.seen);
    for (std::size_t k = 0; k < pairs.rest.size(); ++k) {
      const Eigen::Vector3d from = pairs.rest[k] - rest,
                            to = world.world_from_recording * (pairs.seen[k] - seen);
      const double x = from.x(), y = -from.z();  // the T-pose's z is the world's -y
      sine += pairs.weight[k] * (x * to.y() - y * to.x());
      cosine += pairs.weight[k] * (x * to.x() + y * to.y());
    }
  }
  world.facing_rad = std::atan2(sine, cosine);
  return world;
}

MarkerRecording InWorld(const MarkerRecording& recording, const MarkerWorld& world, double lift_m) {
  MarkerRecording in_world = recording;
  const Eigen::Matrix3d turn = world.scale * world.world_from_recording;
  for (int t = 0; t < recording.NumFrames(); ++t) {
    for (int m = 0; m < recording.NumMarkers(); ++m) {
      in_world.positions.block<3, 1>(3 * m, t) =
          turn * recording.At(m, t) + lift_m * Eigen::Vector3d::UnitZ();
    }
  }
  return in_world;
}

Eigen::Matrix<double, 6, 1> RootAt(const MarkedPerson& person, const SeenMarkers& seen,
                                   double facing_rad) {
  Pairs pairs = PairsOf(person, seen.marker, seen.place, true);
  if (pairs.rest.empty()) pairs = PairsOf(person, seen.marker, seen.place, false);
  const Eigen::Matrix3d R = ExpSO3(Eigen::Vector3d::UnitZ() * facing_rad) *
                            ExpSO3(Eigen::Vector3d::UnitX() * 90.0 * kDegree);
  const Eigen::Vector3d pelvis = person.body.rest_joints.col(0);
  // Selects one of the two equivalent axes of a half turn consistently, for people facing +y.
  const Eigen::Vector3d half_turn(0.0, 2.2, 2.2);
  Eigen::Matrix<double, 6, 1> root;
  root << Mean(pairs.seen) - pelvis - R * (Mean(pairs.rest) - pelvis),
      UnwrapAxisAngle(LogSO3(R), half_turn);
  return root;
}

namespace {

namespace fs = std::filesystem;

bool IsRecording(const fs::path& path) {
  std::string name = path.filename().string();
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  return std::ranges::any_of(std::array{".c3d", ".trc", ".csv", ".tsv"},
                             [&](const char* ending) { return name.ends_with(ending); }) &&
         !MarkerFormatOf(ReadGzipHead(path, 1024)).empty();
}

constexpr std::string_view kStatic = "_static";

bool IsStatic(const fs::path& file) {
  return file.filename().string().find(kStatic) != std::string::npos;
}

// Part of the name before "_static".
std::string PersonOf(const fs::path& still) {
  const std::string name = still.filename().string();
  return name.substr(0, name.find(kStatic));
}

// Static trial of a recording; of several, the one whose name up to "_static" is its prefix.
fs::path StillOf(const fs::path& file, const std::vector<fs::path>& beside) {
  if (beside.size() < 2) return beside.empty() ? fs::path() : beside.front();
  const std::string own = file.filename().string();
  fs::path best;
  std::size_t longest = 0;
  for (const fs::path& still : beside) {
    const std::string person = PersonOf(still);
    if (person.size() <= longest || !own.starts_with(person)) continue;
    longest = person.size();
    best = still;
  }
  if (best.empty()) {
    throw Error(file.string(),
                "has several static trials in its folder, none of which matches its name",
                "Start its name like that of its static trial, or use one folder per person");
  }
  return best;
}

}  // namespace

std::string MarkerTrialFiles::Person() const {
  const std::string person = still.empty() ? "" : PersonOf(still);
  return person.empty() ? recording.parent_path().filename().string() : person;
}

std::vector<MarkerTrialFiles> FindMarkerTrials(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw Error(folder.string(), "is not a folder",
                "Give a folder with recordings and a ..._static... file for each person");
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && IsRecording(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::map<fs::path, std::vector<fs::path>> still;
  for (const fs::path& file : files) {
    if (IsStatic(file)) still[file.parent_path()].push_back(file);
  }
  std::vector<MarkerTrialFiles> trials;
  for (const fs::path& file : files) {
    if (IsStatic(file)) continue;
    const std::string name = file.filename().string();
    trials.push_back(
        {name.substr(0, name.find('.')), file, StillOf(file, still[file.parent_path()])});
  }
  if (trials.empty()) {
    throw Error(folder.string(), "holds no recordings of markers",
                "Give a folder with .c3d, .trc, .csv or .tsv files of labeled markers");
  }
  return trials;
}

}  // namespace holdfast
