// SPDX-License-Identifier: MIT
#include "generator/imos/attention.h"

#include <cmath>

#include <fmt/format.h>

namespace holdfast::imos {

Eigen::MatrixXd PositionalEncoding(int joints) {
  Eigen::MatrixXd encoding(kRotationSize, joints);
  for (int p = 0; p < joints; ++p) {
    for (int i = 0; i < kRotationSize; ++i) {
      const double angle = p / std::pow(10000.0, 2.0 * i / kRotationSize);
      encoding(i, p) = i % 2 == 0 ? std::sin(angle) : std::cos(angle);
    }
  }
  return encoding;
}

template <typename Real>
Attention<Real>::Attention(const nn::TensorMap& tensors, const Config& config,
                           const std::string& where)
    : position_((kPositionScale * PositionalEncoding(config.BodyJoints())).cast<Real>()) {
  const int heads = config.attention_heads, width = config.attention_width;
  const int joints = config.BodyJoints();
  for (int l = 0; l < config.attention_layers; ++l) {
    const std::string name = fmt::format("body.attention_model.attention_layers.{}.attn.", l);
    const auto read = [&](const char* part, int rows, int columns) -> Eigen::MatrixXd {
      return nn::ReadMatrix(tensors, name + part, where, rows, columns).template cast<double>();
    };
    const Eigen::MatrixXd query = read("w_qs.weight", heads * width, kRotationSize);
    const Eigen::MatrixXd key = read("w_ks.weight", heads * width, kRotationSize);
    const Eigen::MatrixXd value = read("w_vs.weight", heads * width, kRotationSize);
    const Eigen::MatrixXd combine = read("w_combine.weight", kRotationSize, heads * width);
    Layer& layer = layers_.emplace_back();
    for (int h = 0; h < heads; ++h) {
      const auto rows = [&](const Eigen::MatrixXd& of) { return of.middleRows(h * width, width); };
      layer.scores.push_back(
          (rows(query).transpose() * rows(key) / std::sqrt(double(width))).template cast<Real>());
      layer.values.push_back(
          (combine.middleCols(h * width, width) * rows(value)).template cast<Real>());
    }
    layer.gain = read("layer_norm.weight", joints, kRotationSize).transpose().template cast<Real>();
    layer.offset = read("layer_norm.bias", joints, kRotationSize).transpose().template cast<Real>();
  }
}

template <typename Real>
typename Attention<Real>::Tape Attention<Real>::MakeTape() const {
  Tape tape;
  tape.layers.resize(layers_.size());
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    tape.layers[l].attention.resize(layers_[l].scores.size());
  }
  return tape;
}

template <typename Real>
void Attention<Real>::Forward(const Real* pose, Real* out, Tape& tape) const {
  const int joints = NumJoints();
  const Real share = Real(1) / static_cast<Real>(kRotationSize * joints);
  const Tokens& x = tape.tokens = Eigen::Map<const Tokens>(pose, kRotationSize, joints) + position_;
  Tokens q = x, projected(kRotationSize, joints), sum(kRotationSize, joints);
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const Layer& layer = layers_[l];
    typename Tape::Layer& kept = tape.layers[l];
    kept.query = q;
    sum = q;
    for (std::size_t h = 0; h < layer.scores.size(); ++h) {
      Weights& weights = kept.attention[h];
      projected.noalias() = layer.scores[h].lazyProduct(x);
      weights.noalias() = projected.transpose().lazyProduct(q);  // keys x queries: columns to sum
      for (int i = 0; i < joints; ++i) {
        auto column = weights.col(i).array();
        column = (column - column.maxCoeff()).exp();
        column /= column.sum();
      }
      projected.noalias() = layer.values[h].lazyProduct(x);
      sum.noalias() += projected.lazyProduct(weights);
    }
    const Real mean = sum.sum() * share;
    const Real variance = (sum.array() - mean).square().sum() * share;
    kept.inverse_deviation = Real(1) / std::sqrt(variance + Real(kAttentionEpsilon));
    kept.normed = (sum.array() - mean) * kept.inverse_deviation;
    q = kept.normed.cwiseProduct(layer.gain) + layer.offset;
  }
  Eigen::Map<Tokens>(out, kRotationSize, joints) = q;
}

template <typename Real>
void Attention<Real>::Backward(const Tape& tape, const Real* out_bar, Real* pose_bar) const {
  const int joints = NumJoints();
  const Real share = Real(1) / static_cast<Real>(kRotationSize * joints);
  const Tokens& x = tape.tokens;
  Tokens q_bar = Eigen::Map<const Tokens>(out_bar, kRotationSize, joints);
  Tokens x_bar = Tokens::Zero(kRotationSize, joints), sum_bar(kRotationSize, joints);
  Tokens projected(kRotationSize, joints), projected_bar(kRotationSize, joints);
  Tokens normed_bar = Tokens::Zero(kRotationSize, joints);
  Weights weights_bar(joints, joints);
  for (std::size_t l = layers_.size(); l-- > 0;) {
    const Layer& layer = layers_[l];
    const typename Tape::Layer& kept = tape.layers[l];
    normed_bar = q_bar.cwiseProduct(layer.gain);
    const Real average = normed_bar.sum() * share;
    const Real correlation = normed_bar.cwiseProduct(kept.normed).sum() * share;
    sum_bar =
        (normed_bar.array() - average - kept.normed.array() * correlation) * kept.inverse_deviation;
    q_bar = sum_bar;
    for (std::size_t h = 0; h < layer.scores.size(); ++h) {
      const Weights& weights = kept.attention[h];
      projected.noalias() = layer.values[h].lazyProduct(x);
      projected_bar.noalias() = sum_bar.lazyProduct(weights.transpose());
      x_bar.noalias() += layer.values[h].transpose().lazyProduct(projected_bar);
      weights_bar.noalias() = projected.transpose().lazyProduct(sum_bar);
      for (int i = 0; i < joints; ++i) {  // of the softmax
        const Real common = weights_bar.col(i).dot(weights.col(i));
        weights_bar.col(i) = weights.col(i).array() * (weights_bar.col(i).array() - common);
      }
      // The scores are (M X)^T q for keys x queries, with M X = `projected`. M maps keys, so that
      // q^T M X has M^T q on the other side.
      projected.noalias() = layer.scores[h].lazyProduct(x);
      q_bar.noalias() += projected.lazyProduct(weights_bar);
      projected_bar.noalias() = kept.query.lazyProduct(weights_bar.transpose());
      x_bar.noalias() += layer.scores[h].transpose().lazyProduct(projected_bar);
    }
  }
  Eigen::Map<Tokens>(pose_bar, kRotationSize, joints) += x_bar + q_bar;
}

template class Attention<float>;
template class Attention<double>;

}  // namespace holdfast::imos
