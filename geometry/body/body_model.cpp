// SPDX-License-Identifier: MIT
#include "geometry/body/body_model.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "geometry/body/body_model_reader.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/options.h"

namespace holdfast {
namespace {

template <typename T>
std::span<const T> As(const std::vector<std::byte>& data) {
  return {reinterpret_cast<const T*>(data.data()), data.size() / sizeof(T)};
}

// The largest finite half is 65,504, so values beyond kMaxMeters are infinite or NaN.
std::optional<std::size_t> FirstNotFinite(std::span<const std::uint16_t> halves) {
  static_assert(kMaxMeters > 65504.0);
  const auto bits = [](std::uint16_t half) { return half & 0x7fff; };
  int most = 0;
  for (const std::uint16_t half : halves) most = std::max(most, bits(half));
  if (most < 0x7c00) return std::nullopt;
  const auto bad = std::ranges::find_if(halves, [&](auto half) { return bits(half) >= 0x7c00; });
  return static_cast<std::size_t>(bad - halves.begin());
}

}  // namespace

LinearBasis::LinearBasis(NpyMember member, std::ptrdiff_t vertices, std::ptrdiff_t columns) {
  member.RequireShape({vertices, 3, columns});
  NpyArray& array = member.array;
  columns_ = array.shape[2];
  item_size_ = array.kind != 'f' || array.item_size >= 8 ? 8 : 4;
  std::vector<std::byte> data;
  const auto copy = [&](const auto& values) {
    data.resize(values.size() * sizeof(values[0]));
    if (!values.empty()) std::memcpy(data.data(), values.data(), data.size());
  };
  const bool halves =
      array.kind == 'f' && array.item_size == 2 && !array.big_endian && !array.fortran_order;
  if (halves) item_size_ = 2;
  if (halves || member.View<float>() || member.View<double>()) {
    data = std::move(array.data);
  } else if (item_size_ == 8) {
    copy(member.AsDoubles());
  } else {
    copy(member.AsFloats());
  }
  const auto bad = item_size_ == 8   ? FirstBeyond(As<double>(data), kMaxMeters)
                   : item_size_ == 4 ? FirstBeyond(As<float>(data), kMaxMeters)
                                     : FirstNotFinite(As<std::uint16_t>(data));
  if (bad) {
    const double value = item_size_ == 8   ? As<double>(data)[*bad]
                         : item_size_ == 4 ? As<float>(data)[*bad]
                                           : HalfToFloat(As<std::uint16_t>(data)[*bad]);
    throw Error(member.where, fmt::format("holds {} at element {}", value, *bad),
                "The model file is damaged: get it again");
  }
  data_ = std::make_shared<const std::vector<std::byte>>(std::move(data));
}

void LinearBasis::Negate(std::size_t coordinate) {
  if (!data_ || columns_ == 0) return;
  std::vector<std::byte> data = *data_;
  const std::size_t row_bytes = columns_ * item_size_;
  for (std::size_t row = coordinate; (row + 1) * row_bytes <= data.size(); row += 3) {
    // The sign is the highest bit of the last byte, in all three types.
    for (std::size_t k = 0; k < columns_; ++k) {
      data[row * row_bytes + (k + 1) * item_size_ - 1] ^= std::byte{0x80};
    }
  }
  data_ = std::make_shared<const std::vector<std::byte>>(std::move(data));
}

void LinearBasis::CopyRow(std::size_t row, std::size_t begin, std::size_t count,
                          double* out) const {
  const std::size_t first = row * columns_ + begin;
  if (item_size_ == 8) {
    std::memcpy(out, As<double>(*data_).data() + first, count * sizeof(double));
  } else if (item_size_ == 4) {
    std::copy_n(As<float>(*data_).data() + first, count, out);
  } else {
    std::transform(As<std::uint16_t>(*data_).data() + first,
                   As<std::uint16_t>(*data_).data() + first + count, out, HalfToFloat);
  }
}

bool LinearBasis::IsZero(std::size_t row, std::size_t begin, std::size_t count) const {
  const std::size_t first = row * columns_ + begin;
  const std::byte* const bytes = data_->data() + first * item_size_;
  const std::size_t size = count * item_size_;
  // The common case, tested at once: each byte equals its predecessor and the first is 0.
  if (size == 0 || (bytes[0] == std::byte{0} && std::memcmp(bytes, bytes + 1, size - 1) == 0)) {
    return true;
  }
  const auto zeros = [&](const auto& values) {
    return std::ranges::all_of(values.subspan(first, count), [](auto x) { return x == 0; });
  };
  if (item_size_ == 8) return zeros(As<double>(*data_));
  if (item_size_ == 4) return zeros(As<float>(*data_));
  return std::ranges::all_of(As<std::uint16_t>(*data_).subspan(first, count),
                             [](unsigned half) { return (half & 0x7fff) == 0; });  // 0 or -0
}

BodyModel::BodyModel(BodyModelParts parts)
    : parts_(std::make_shared<const BodyModelParts>(std::move(parts))),
      v_template_(parts_->v_template) {}

BodyModel::BodyModel(std::shared_ptr<const BodyModelParts> parts, Eigen::Matrix3Xd v_template)
    : parts_(std::move(parts)), v_template_(std::move(v_template)), is_subject_(true) {}

std::shared_ptr<const BodyModel> BodyModel::Load(const std::filesystem::path& path) {
  BodyModelParts parts = ReadBodyModel(path);
  parts.source = path.string();
  return std::make_shared<const BodyModel>(std::move(parts));
}

std::string BodyModel::ShapeNote() const {
  if (!parts_->shape_x_corrected) return {};
  return fmt::format(
      "warning: the x components of the shape directions of {} have the sign of the right hand, a "
      "known error of the published MANO_LEFT.pkl (smplx issue 48): the sign is corrected; betas "
      "fitted with the uncorrected file describe a different hand",
      Name());
}

std::shared_ptr<const BodyModel> BodyModel::Default() {
  static const auto model = [] {
    const EmbeddedFile file = FindEmbedded(fmt::format("body/{}.npz", kDefaultName));
    return std::make_shared<const BodyModel>(
        ReadBodyModel(NpzReader(file.bytes, std::string(file.name)), std::string(kDefaultName)));
  }();
  return model;
}

std::shared_ptr<const BodyModel> BodyModel::WithTemplate(std::shared_ptr<const BodyModel> model,
                                                         Eigen::Matrix3Xd v_template) {
  if (v_template.cols() != model->NumVertices()) {
    throw Error("v_template",
                fmt::format("has {} vertices, {} has {}", v_template.cols(), model->Name(),
                            model->NumVertices()),
                "Give the body model that the subject's surface belongs to");
  }
  const std::span<const double> values(v_template.data(),
                                       static_cast<std::size_t>(v_template.size()));
  if (FirstBeyond(values, kMaxMeters)) {
    throw Error("v_template", "holds NaN, infinite or huge values", "Get the surface again");
  }
  return std::shared_ptr<const BodyModel>(new BodyModel(model->parts_, std::move(v_template)));
}

Eigen::Matrix3Xd BodyModel::ShapedVertices(const Eigen::VectorXd& betas,
                                           const Eigen::VectorXd& expression) const {
  const auto check = [&](const char* what, const Eigen::VectorXd& coefficients, int available) {
    const Eigen::Index given = coefficients.size();
    if (given <= available || coefficients.tail(given - available).isZero(0.0)) return;
    throw Error(Source(),
                fmt::format("has {} {} coefficients, {} were given", available, what, given),
                "Give at most that many, or use another model");
  };
  if (!is_subject_) check("shape", betas, NumShape());
  check("expression", expression, NumExpression());
  Eigen::Matrix3Xd shaped = v_template_;
  const auto add = [&](const Eigen::VectorXd& given, int begin, int available) {
    const Eigen::VectorXd coefficients =
        given.head(std::min<Eigen::Index>(given.size(), available));
    if (coefficients.isZero(0.0)) return;
    Eigen::VectorXd row(coefficients.size());
    for (Eigen::Index i = 0; i < shaped.size(); ++i) {
      parts_->shape_dirs.CopyRow(static_cast<std::size_t>(i), static_cast<std::size_t>(begin),
                                 static_cast<std::size_t>(row.size()), row.data());
      shaped(i) += row.dot(coefficients);
    }
  };
  if (!is_subject_) add(betas, 0, NumShape());
  add(expression, NumShape(), NumExpression());
  return shaped;
}

Eigen::Matrix3Xd BodyModel::RestJoints(const Eigen::Matrix3Xd& shaped_vertices) const {
  Eigen::Matrix3Xd joints = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) {
    for (const auto& [v, w] : parts_->joint_regressor[static_cast<std::size_t>(j)]) {
      joints.col(j) += w * shaped_vertices.col(v);
    }
  }
  return joints;
}

}  // namespace holdfast
