// SPDX-License-Identifier: MIT
#include "meshes/make/body/loft.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace holdfast {

using Eigen::Vector3d;

Loft::Loft(const Vector3d& begin, const Vector3d& end, const Vector3d& u_hint,
           const Vector3d& v_hint, const std::vector<Section>& sections_mm, double begin_cap_mm,
           double end_cap_mm)
    : origin_(begin), begin_cap_(1e-3 * begin_cap_mm), end_cap_(1e-3 * end_cap_mm) {
  w_ = (end - begin).normalized();
  u_ = (u_hint - w_ * w_.dot(u_hint)).normalized();
  v_ = v_hint - w_ * w_.dot(v_hint);
  v_ = (v_ - u_ * u_.dot(v_)).normalized();
  for (const Section& s : sections_mm) {
    at_.push_back(1e-3 * s.at);
    Channels c;
    c << s.u_centre, s.v_centre, s.u_minus, s.u_plus, s.v_minus, s.v_plus, 1e3 * s.power;
    values_.push_back(1e-3 * c);
  }
  // Slopes of Fritsch and Carlson (1980): no overshoot between sections. Zero at both ends, so that
  // the caps join smoothly.
  slopes_.assign(values_.size(), Channels::Zero());
  for (std::size_t i = 1; i + 1 < values_.size(); ++i) {
    const double h0 = at_[i] - at_[i - 1];
    const double h1 = at_[i + 1] - at_[i];
    for (int c = 0; c < kChannels; ++c) {
      const double d0 = (values_[i][c] - values_[i - 1][c]) / h0;
      const double d1 = (values_[i + 1][c] - values_[i][c]) / h1;
      if (d0 * d1 <= 0) continue;
      const double w0 = 2 * h1 + h0;
      const double w1 = h1 + 2 * h0;
      slopes_[i][c] = (w0 + w1) / (w0 / d0 + w1 / d1);
    }
  }
}

Loft::Channels Loft::Interpolate(double at) const {
  if (at <= at_.front()) return values_.front();
  if (at >= at_.back()) return values_.back();
  const std::size_t i =
      static_cast<std::size_t>(std::upper_bound(at_.begin(), at_.end(), at) - at_.begin()) - 1;
  const double h = at_[i + 1] - at_[i];
  const double t = (at - at_[i]) / h;
  const double t2 = t * t;
  const double t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * values_[i] + h * (t3 - 2 * t2 + t) * slopes_[i] +
         (3 * t2 - 2 * t3) * values_[i + 1] + h * (t3 - t2) * slopes_[i + 1];
}

double Loft::operator()(const Vector3d& point) const {
  const Vector3d local = point - origin_;
  const double w = local.dot(w_);
  const Channels c = Interpolate(w);
  const double u = local.dot(u_) - c[0];
  const double v = local.dot(v_) - c[1];
  const double ru = u < 0 ? c[2] : c[3];
  const double rv = v < 0 ? c[4] : c[5];
  const double n = c[6];
  const double a = std::abs(u) / ru;
  const double b = std::abs(v) / rv;

  // k is 1 on the surface and homogeneous of degree one in (u, v, dw), so (k - 1) / |grad k| is the
  // distance to first order.
  double k, gu, gv;
  if (std::abs(n - 2.0) < 1e-9) {
    k = std::hypot(a, b);
    gu = k > 0 ? a / (k * ru) : 1 / ru;
    gv = k > 0 ? b / (k * rv) : 1 / rv;
  } else {
    k = std::pow(std::pow(a, n) + std::pow(b, n), 1 / n);
    gu = k > 0 ? std::pow(a / k, n - 1) / ru : 1 / ru;
    gv = k > 0 ? std::pow(b / k, n - 1) / rv : 1 / rv;
  }
  double gw = 0;
  const double over = w < at_.front() ? at_.front() - w : (w > at_.back() ? w - at_.back() : 0.0);
  if (over > 0) {
    const double cap = w < at_.front() ? begin_cap_ : end_cap_;
    const double s = over / cap;
    const double total = std::hypot(k, s);
    gu *= k / total;
    gv *= k / total;
    gw = s / (total * cap);
    k = total;
  }
  return (k - 1) / std::sqrt(gu * gu + gv * gv + gw * gw);
}

double EllipsoidDistance(const Vector3d& point, const Vector3d& semi_axes) {
  const Vector3d q = point.cwiseQuotient(semi_axes);
  const double k = q.norm();
  if (k == 0) return -semi_axes.minCoeff();
  return (k - 1) * k / q.cwiseQuotient(semi_axes).norm();
}

double SmoothUnion(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * h * width / 6.0;
}

double SmoothIntersection(double a, double b, double width) { return -SmoothUnion(-a, -b, width); }

}  // namespace holdfast
