// SPDX-License-Identifier: MIT
#include "generator/nn/column_network.h"

#include <algorithm>
#include <cassert>

#include "generator/nn/mlp.h"
#include "generator/nn/residual_mlp.h"

namespace holdfast::nn {
namespace {

// Upper bound on the inner dimension of any product.
int Widest(const std::vector<int>& rows) { return *std::max_element(rows.begin(), rows.end()); }

}  // namespace

template <typename Real>
std::unique_ptr<const ColumnNetwork<Real>> MakeNetwork(const AnyWeights& weights, Isa isa) {
  if (const auto* chain = std::get_if<MlpWeights>(&weights)) {
    return std::make_unique<const Mlp<Real>>(*chain, isa);
  }
  return std::make_unique<const ResidualMlp<Real>>(std::get<ResidualWeights>(weights), isa);
}

template <typename Real>
Tape<Real>::Tape(const ColumnNetwork<Real>& network, int max_columns)
    : rows_(network.RoomNeeded().levels), max_columns_(max_columns), num_columns_(max_columns) {
  std::size_t size = 0;
  for (const int rows : rows_) {
    begin_.push_back(size);
    size += static_cast<std::size_t>(PaddedRows(rows)) * max_columns;
  }
  values_.assign(size, Real(0));
  mean_.assign(At(network.RoomNeeded().num_norms), Real(0));
  inverse_deviation_ = mean_;
  visited_.resize(Widest(rows_));
}

template <typename Real>
void Tape<Real>::Resize(int num_columns) {
  assert(num_columns >= 0 && num_columns <= max_columns_);
  num_columns_ = num_columns;
}

template <typename Real>
Scratch<Real>::Scratch(const ColumnNetwork<Real>& network, int max_gradients)
    : rows_(network.RoomNeeded().gradients), max_gradients_(max_gradients) {
  for (const int rows : rows_) {
    gradients_.emplace_back(static_cast<std::size_t>(PaddedRows(rows)) * max_gradients, Real(0));
  }
  visited_.resize(std::max(Widest(rows_), network.OutputSize()));
}

template class Tape<float>;
template class Tape<double>;
template class Scratch<float>;
template class Scratch<double>;
template std::unique_ptr<const ColumnNetwork<float>> MakeNetwork(const AnyWeights&, Isa);
template std::unique_ptr<const ColumnNetwork<double>> MakeNetwork(const AnyWeights&, Isa);

}  // namespace holdfast::nn
