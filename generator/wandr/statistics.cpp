// SPDX-License-Identifier: MIT
#include "generator/wandr/statistics.h"

#include <cmath>

#include <fmt/format.h>

#include "generator/wandr/intention.h"
#include "generator/wandr/pose.h"
#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

// Calls visit(name, moments) for every feature.
template <typename S, typename Visit>
void ForEachFeature(S& statistics, const Visit& visit) {
  visit("body_transl", statistics.body_transl);
  visit("body_orient", statistics.body_orient);
  visit("body_orient_xy", statistics.body_orient_xy);
  visit("body_pose", statistics.body_pose);
  visit("body_transl_delta_pelv_xy", statistics.body_transl_delta_pelv_xy);
  visit("body_orient_delta", statistics.body_orient_delta);
  visit("body_pose_delta", statistics.body_pose_delta);
}

template <int kSize>
void Read(const nn::TensorMap& tensors, const std::string& name, const std::string& where,
          bool positive, Eigen::Matrix<double, kSize, 1>& out) {
  constexpr const char* kStatisticsRemedy = "Give a file of a WANDR network with its statistics";
  const auto found = tensors.find(name);
  if (found == tensors.end()) {
    throw Error(where, fmt::format("there is no tensor '{}'", name), kStatisticsRemedy);
  }
  const std::vector<float>& values = found->second.values;
  if (values.size() != static_cast<std::size_t>(kSize)) {
    throw Error(where, fmt::format("'{}' has {} values, {} are needed", name, values.size(), kSize),
                kStatisticsRemedy);
  }
  for (int i = 0; i < kSize; ++i) {
    if (!std::isfinite(values[i]) || (positive && values[i] < 0.0f)) {
      throw Error(where, fmt::format("'{}' holds {}", name, values[i]), kStatisticsRemedy);
    }
    out[i] = values[i];
  }
}

template <typename T, int kSize, typename... Parts>
Affine<T, kSize> Joined(const Parts&... parts) {
  Eigen::Matrix<double, kSize, 1> mean, deviation;
  int row = 0;
  const auto append = [&](const auto& part) {
    mean.segment(row, part.mean.size()) = part.mean;
    deviation.segment(row, part.mean.size()) = part.deviation;
    row += static_cast<int>(part.mean.size());
  };
  (append(parts), ...);
  deviation.array() += 1e-5;
  return {mean.template cast<T>(), deviation.cwiseInverse().template cast<T>(),
          deviation.template cast<T>()};
}

}  // namespace

void StatisticsGatherer::Add(const Eigen::Ref<const StateMatrix<double>>& states) {
  Pose<double> previous;
  for (Eigen::Index i = 0; i < states.cols(); ++i) {
    const Pose<double> pose = PoseOf<double>(states.col(i));
    Eigen::Matrix<double, kSize, 1> x;
    x.head<kStateSize>() = StateOf(pose);
    x.segment<6>(kStateSize) = Rows12<double>(
        WithoutHeading<double>(HeadingOf<double>(pose.rotation[0]), pose.rotation[0]));
    x.tail<kStateSize>() = i == 0 ? RestDelta<double>() : DeltaBetween(previous, pose);
    ++count_;
    const Eigen::Matrix<double, kSize, 1> from_old = x - mean_;
    mean_ += from_old / static_cast<double>(count_);
    squares_ += from_old.cwiseProduct(x - mean_);
    previous = pose;
  }
}

Statistics StatisticsGatherer::Finish() const {
  if (count_ < 2) {
    throw Error("statistics", fmt::format("there are {} frames", count_),
                "Give motion of two frames or more");
  }
  const Eigen::Matrix<double, kSize, 1> deviation =
      (squares_ / static_cast<double>(count_ - 1)).cwiseSqrt();
  Statistics out;
  const auto take = [&](int row, auto& moments) {
    moments.mean = mean_.segment(row, moments.mean.size());
    moments.deviation = deviation.segment(row, moments.mean.size());
  };
  take(0, out.body_transl);
  take(3, out.body_orient);
  take(9, out.body_pose);
  take(kStateSize, out.body_orient_xy);
  take(kStateSize + 6, out.body_transl_delta_pelv_xy);
  take(kStateSize + 9, out.body_orient_delta);
  take(kStateSize + 15, out.body_pose_delta);
  return out;
}

Statistics StatisticsFromTensors(const nn::TensorMap& tensors, const std::string& where) {
  Statistics statistics;
  ForEachFeature(statistics, [&](const char* feature, auto& moments) {
    const std::string name = fmt::format("statistics.{}", feature);
    Read(tensors, name + ".mean", where, false, moments.mean);
    Read(tensors, name + ".std", where, true, moments.deviation);
  });
  return statistics;
}

void AddTensors(const Statistics& statistics, nn::TensorMap& tensors) {
  ForEachFeature(statistics, [&](const char* feature, const auto& moments) {
    const std::string name = fmt::format("statistics.{}", feature);
    tensors[name + ".mean"] = nn::VectorTensor(moments.mean.template cast<float>());
    tensors[name + ".std"] = nn::VectorTensor(moments.deviation.template cast<float>());
  });
}

template <typename T>
Normalizer<T>::Normalizer(const Statistics& s) {
  FeatureMoments<1> height;
  height.mean[0] = s.body_transl.mean.z();
  height.deviation[0] = s.body_transl.deviation.z();
  pose = Joined<T, kPoseFeatures>(height, s.body_orient_xy, s.body_pose);
  delta =
      Joined<T, kStateSize>(s.body_transl_delta_pelv_xy, s.body_orient_delta, s.body_pose_delta);
}

template struct Normalizer<float>;
template struct Normalizer<double>;

}  // namespace holdfast::wandr
