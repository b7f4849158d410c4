// SPDX-License-Identifier: MIT
#include "generator/imos/synthesis_metrics.h"

#include <cmath>
#include <map>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include "generator/nn/random_stream.h"
#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr int kDiversityPairs = 200;
constexpr int kPairsPerLabel = 20;
constexpr int kDraws = 10'001;  // the code counts to 10,000 inclusive

// Symmetric, with the eigenvalues that rounding made negative at zero.
Eigen::MatrixXd Root(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose();
}

void RequireMotions(const Eigen::MatrixXf& features, Eigen::Index least) {
  if (features.cols() >= least) return;
  throw Error("features", fmt::format("are of {} motion(s), {} are needed", features.cols(), least),
              "Evaluate more sequences");
}

void RequireLabels(std::size_t labels, Eigen::Index motions) {
  if (static_cast<Eigen::Index>(labels) == motions && motions > 0) return;
  throw Error("labels", fmt::format("{} of them stand against {} motions", labels, motions),
              "Give one of each motion");
}

struct Gaussian {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

Gaussian GaussianOf(const Eigen::MatrixXf& features) {
  Gaussian gaussian;
  gaussian.mean = features.cast<double>().rowwise().mean();
  const Eigen::MatrixXd centerd = features.cast<double>().colwise() - gaussian.mean;
  gaussian.covariance = centerd * centerd.transpose() / static_cast<double>(features.cols() - 1);
  return gaussian;
}

double Distance(const Eigen::MatrixXf& features, Eigen::Index a, Eigen::Index b) {
  return (features.col(a) - features.col(b)).cast<double>().norm();
}

Eigen::Index Draw(nn::RandomStream& random, Eigen::Index count) {
  return static_cast<Eigen::Index>(random.Uniform() * static_cast<double>(count));
}

double DeviationOf(const Eigen::Ref<const Eigen::VectorXf>& values) {
  const Eigen::VectorXd exact = values.cast<double>();
  return std::sqrt((exact.array() - exact.mean()).square().sum() /
                   static_cast<double>(exact.size() - 1));
}

}  // namespace

double FrechetDistanceOfCode(const Eigen::MatrixXf& features, const Eigen::MatrixXf& reference) {
  RequireMotions(features, 1);
  if (features.rows() != reference.rows() || features.cols() != reference.cols()) {
    throw Error("features",
                fmt::format("are {} x {}, those of the reference {} x {}", features.rows(),
                            features.cols(), reference.rows(), reference.cols()),
                "This distance is of a motion and its own reference");
  }
  double sum = 0.0;
  for (Eigen::Index n = 0; n < features.cols(); ++n) {
    const double spread = DeviationOf(features.col(n)) - DeviationOf(reference.col(n));
    sum += (features.col(n) - reference.col(n)).cast<double>().squaredNorm() + spread * spread;
  }
  return sum / static_cast<double>(features.cols());
}

double FrechetDistance(const Eigen::MatrixXf& features, const Eigen::MatrixXf& reference) {
  RequireMotions(features, 2);
  RequireMotions(reference, 2);
  const Gaussian a = GaussianOf(features), b = GaussianOf(reference);
  const Eigen::MatrixXd root = Root(a.covariance);
  // Of C^1/2 C' C^1/2, which has the eigenvalues of C C' and is symmetric.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> product(root * b.covariance * root,
                                                               Eigen::EigenvaluesOnly);
  const double shared = product.eigenvalues().cwiseMax(0.0).cwiseSqrt().sum();
  return std::max(0.0, (a.mean - b.mean).squaredNorm() + a.covariance.trace() +
                           b.covariance.trace() - 2.0 * shared);
}

double RecognitionAccuracy(std::span<const int> recognized, std::span<const int> labels) {
  RequireLabels(labels.size(), static_cast<Eigen::Index>(recognized.size()));
  int right = 0;
  for (std::size_t n = 0; n < labels.size(); ++n) right += recognized[n] == labels[n];
  return static_cast<double>(right) / static_cast<double>(labels.size());
}

double DiversityOfCode(const Eigen::MatrixXf& features, std::uint64_t seed) {
  RequireMotions(features, 1);
  nn::RandomStream random(seed);
  double sum = 0.0;
  for (int k = 0; k < kDiversityPairs; ++k) {
    const Eigen::Index a = Draw(random, features.cols());
    sum += Distance(features, a, Draw(random, features.cols()));
  }
  return sum / kDiversityPairs;
}

double Diversity(const Eigen::MatrixXf& features) {
  RequireMotions(features, 2);
  double sum = 0.0;
  for (Eigen::Index a = 0; a < features.cols(); ++a) {
    for (Eigen::Index b = 0; b < a; ++b) sum += Distance(features, a, b);
  }
  return 2.0 * sum / static_cast<double>(features.cols() * (features.cols() - 1));
}

double MultimodalityOfCode(const Eigen::MatrixXf& features, std::span<const int> recognized,
                           int num_labels, std::uint64_t seed) {
  RequireLabels(recognized.size(), features.cols());
  std::vector<std::vector<Eigen::Index>> of_label(num_labels);
  for (std::size_t n = 0; n < recognized.size(); ++n) {
    of_label.at(recognized[n]).push_back(static_cast<Eigen::Index>(n));
  }
  std::vector<int> left(num_labels, kPairsPerLabel);
  nn::RandomStream random(seed);
  double sum = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    const Eigen::Index first = Draw(random, features.cols());
    const int label = recognized[first];
    if (left[label] == 0) continue;
    --left[label];
    // Drawing until the labels agree, as the code does, is drawing among those of the label.
    const auto& others = of_label[label];
    sum += Distance(features, first, others[Draw(random, std::ssize(others))]);
  }
  return sum / (kPairsPerLabel * num_labels);
}

std::optional<double> Multimodality(const Eigen::MatrixXf& features, std::span<const int> labels) {
  RequireLabels(labels.size(), features.cols());
  std::map<int, std::vector<Eigen::Index>> of_label;
  for (std::size_t n = 0; n < labels.size(); ++n) {
    of_label[labels[n]].push_back(static_cast<Eigen::Index>(n));
  }
  double sum = 0.0;
  int counted = 0;
  for (const auto& [label, motions] : of_label) {
    if (motions.size() < 2) continue;
    double within = 0.0;
    for (std::size_t a = 0; a < motions.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) within += Distance(features, motions[a], motions[b]);
    }
    sum += 2.0 * within / static_cast<double>(motions.size() * (motions.size() - 1));
    ++counted;
  }
  if (counted == 0) return std::nullopt;
  return sum / counted;
}

RepeatedValue OverRepeats(std::span<const double> values) {
  RepeatedValue result;
  result.repeats = static_cast<int>(values.size());
  if (values.empty()) return result;
  const auto count = static_cast<double>(values.size());
  for (const double value : values) result.mean += value / count;
  if (values.size() < 2) return result;
  double square = 0.0;
  for (const double value : values) square += (value - result.mean) * (value - result.mean);
  result.interval = 1.96 * std::sqrt(square / (count - 1.0) / count);
  return result;
}

}  // namespace holdfast::imos
