// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr std::string_view kExportAnimation = "Export the animation again";
// Times are single precision: a key may be off by this fraction of its time.
constexpr double kTimeNoise = 2.4e-7;
// Tolerance for keys off the frames of a rate, as a fraction of a frame; and the same for a rate
// that is given or rounded to a whole number.
constexpr double kOffGrid = 0.02, kOnGrid = 2e-3;
constexpr double kHighestRate = 10'000;  // Hz

}  // namespace

GltfSampler::GltfSampler(const GltfAsset& asset, const GltfAnimation& animation) : asset_(&asset) {
  begin_ = std::numeric_limits<double>::infinity();
  end_ = -begin_;
  for (const GltfChannel& channel : animation.channels) {
    const GltfNumbers times(asset, channel.input, 1);
    CheckTimes(channel.input, times);
    const int rows = channel.path == GltfPath::kRotation ? 4 : 3;
    const GltfNumbers values(asset, channel.output, rows);
    CheckValues(channel, values, times.Count());
    const Track track{times, values, channel.interpolation};
    if (!tracks_.try_emplace({channel.node, channel.path}, track).second) {
      throw Error(asset.Where(),
                  fmt::format("animation '{}' moves {} twice", animation.name,
                              asset.NodeText(channel.node)),
                  kExportAnimation);
    }
    begin_ = std::min(begin_, times(0, 0));
    end_ = std::max(end_, times(times.Count() - 1, 0));
  }
  if (tracks_.empty()) begin_ = end_ = 0;
}

bool GltfSampler::MovesRigidly(int node) const {
  return tracks_.contains({node, GltfPath::kTranslation}) ||
         tracks_.contains({node, GltfPath::kRotation});
}

void GltfSampler::CheckTimes(int accessor, const GltfNumbers& times) {
  if (!inputs_.try_emplace(accessor, times).second) return;
  const auto fail = [&](const std::string& problem) {
    throw Error(fmt::format("{}[accessors][{}]", asset_->Where(), accessor), problem,
                kExportAnimation);
  };
  if (times.Count() == 0) fail("holds no key times");
  double previous = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < times.Count(); ++i) {
    const double time = times(i, 0);
    if (!std::isfinite(time)) fail(fmt::format("holds {} as the time of key {}", time, i));
    if (time < previous) {
      fail(fmt::format("goes from {} s back to {} s at key {}", previous, time, i));
    }
    previous = time;
  }
}

void GltfSampler::CheckValues(const GltfChannel& channel, const GltfNumbers& values,
                              std::size_t keys) {
  const bool cubic = channel.interpolation == GltfInterpolation::kCubicSpline;
  const bool turns = channel.path == GltfPath::kRotation;
  const auto fail = [&](const std::string& problem) {
    throw Error(fmt::format("{}[accessors][{}]", asset_->Where(), channel.output),
                fmt::format("{} (it moves {})", problem, asset_->NodeText(channel.node)),
                kExportAnimation);
  };
  if (values.Count() != (cubic ? 3 * keys : keys)) {
    fail(fmt::format("holds {} values for {} keys", values.Count(), keys));
  }
  // Many channels may share an accessor; it is checked once.
  if (!checked_.insert({channel.output, cubic, turns}).second) return;
  const int rows = turns ? 4 : 3;
  for (std::size_t i = 0; i < values.Count(); ++i) {
    double square = 0;
    for (int r = 0; r < rows; ++r) {
      const double value = values(i, r);
      if (!std::isfinite(value)) fail(fmt::format("holds {} in element {}", value, i));
      square += value * value;
    }
    const bool is_key = !cubic || i % 3 == 1;
    if (turns && is_key && !(square > 1e-6)) {
      fail(fmt::format("holds a quaternion of zero length in element {}", i));
    }
  }
}

template <int kRows>
Eigen::Matrix<double, kRows, 1> GltfSampler::Evaluate(const Track& track, double time,
                                                      double snap) {
  using Vector = Eigen::Matrix<double, kRows, 1>;
  const bool cubic = track.interpolation == GltfInterpolation::kCubicSpline;
  const std::size_t keys = track.times.Count();
  const auto element = [&](std::size_t i) {
    Vector v;
    for (int r = 0; r < kRows; ++r) v[r] = track.values(i, r);
    return v;
  };
  const auto value = [&](std::size_t key) {
    Vector v = element(cubic ? 3 * key + 1 : key);
    if constexpr (kRows == 4) v.normalize();
    return v;
  };
  std::size_t low = 0, high = keys;  // first key after `time`
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (track.times(middle, 0) <= time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == 0) return value(0);
  const std::size_t before = low - 1;
  const double from = track.times(before, 0);
  if (low == keys || time - from <= snap) return value(before);
  const double to = track.times(low, 0);
  if (to - time <= snap) return value(low);
  if (track.interpolation == GltfInterpolation::kStep) return value(before);

  const double span = to - from, s = (time - from) / span;
  if (cubic) {
    const double s2 = s * s, s3 = s2 * s;
    Vector v = (2 * s3 - 3 * s2 + 1) * element(3 * before + 1) +
               (s3 - 2 * s2 + s) * span * element(3 * before + 2) +
               (-2 * s3 + 3 * s2) * element(3 * low + 1) + (s3 - s2) * span * element(3 * low);
    if constexpr (kRows == 4) {
      // Extreme tangents may pass through zero, where the direction is undefined.
      if (!(v.squaredNorm() > 1e-12) || !v.allFinite()) return value(before);
      v.normalize();
    }
    return v;
  }
  if constexpr (kRows == 4) {
    return Eigen::Quaterniond(value(before)).slerp(s, Eigen::Quaterniond(value(low))).coeffs();
  } else {
    return (1 - s) * value(before) + s * value(low);
  }
}

Eigen::Affine3d GltfSampler::Local(int node, double time, double snap) const {
  GltfNode posed;
  const GltfNode& rest = asset_->NodeAt(node);
  const auto track = [&](GltfPath path) {
    const auto found = tracks_.find({node, path});
    return found == tracks_.end() ? nullptr : &found->second;
  };
  const Track* const shift = track(GltfPath::kTranslation);
  const Track* const turn = track(GltfPath::kRotation);
  const Track* const stretch = track(GltfPath::kScale);
  posed.translation = shift ? Evaluate<3>(*shift, time, snap) : rest.translation;
  posed.rotation = turn ? Eigen::Quaterniond(Evaluate<4>(*turn, time, snap)) : rest.rotation;
  posed.scale = stretch ? Evaluate<3>(*stretch, time, snap) : rest.scale;
  return posed.Local();
}

bool GltfSampler::KeysFit(double rate, double off_grid) const {
  for (const auto& [accessor, times] : inputs_) {
    for (std::size_t i = 0; i < times.Count(); ++i) {
      const double time = times(i, 0), frame = (time - begin_) * rate;
      const double slack = off_grid + 2 * kTimeNoise * std::abs(time) * rate;
      if (std::abs(frame - std::round(frame)) > slack) return false;
    }
  }
  return true;
}

double GltfSampler::FrameRate(double told, bool& regular) const {
  regular = true;
  if (told > 0 && KeysFit(told, kOnGrid)) return told;
  // The densest input gives the rate if its keys are evenly spaced.
  double rate = 0;
  for (const auto& [accessor, times] : inputs_) {
    const std::size_t last = times.Count() - 1;
    const double span = times(last, 0) - times(0, 0);
    if (span > 0) rate = std::max(rate, static_cast<double>(last) / span);
  }
  if (rate == 0) return 30;
  if (rate < kHighestRate) {
    const double whole = std::round(rate);
    if (whole > 0 && KeysFit(whole, kOnGrid)) return whole;
    if (rate >= 5 && KeysFit(rate, kOnGrid)) return rate;
  }
  for (const double usual : {24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 240.0,
                             24 / 1.001, 30 / 1.001, 60 / 1.001}) {
    if (KeysFit(usual, kOffGrid)) return usual;
  }
  regular = false;
  return 60;
}

}  // namespace holdfast
