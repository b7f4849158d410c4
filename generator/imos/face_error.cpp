// SPDX-License-Identifier: MIT
#include "generator/imos/face_error.h"

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr double kAtFace_m = 0.25, kNearer_m = 0.1;

}  // namespace

std::optional<double> FaceError(const Eigen::Matrix3Xd& object, const Eigen::Matrix3Xd& reference,
                                int given) {
  if (object.cols() != reference.cols() || given < 1 || given >= object.cols()) {
    throw Error("places of an object",
                fmt::format("{} key frames stand against {}, {} of them given", object.cols(),
                            reference.cols(), given),
                "Compare motions of one length, with key frames that were made");
  }
  const Eigen::Index made = object.cols() - given;
  Eigen::Index nearest = 0;
  const double distance = reference.rightCols(made).colwise().norm().minCoeff(&nearest);
  if (distance > kAtFace_m || distance > reference.col(given - 1).norm() - kNearer_m) {
    return std::nullopt;
  }
  const Eigen::Vector3d place = reference.col(given + nearest);
  return (object.rightCols(made).colwise() - place).colwise().norm().minCoeff();
}

}  // namespace holdfast::imos
