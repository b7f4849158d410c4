// SPDX-License-Identifier: MIT
#include "generator/training/checkpoint_file.h"

#include <algorithm>
#include <cstdint>

#include "geometry/error.h"

namespace holdfast {

CheckpointWriter::CheckpointWriter(const std::string& format, const std::string& options)
    : texts_{{"format", format}, {"options", options}} {}

void CheckpointWriter::Add(const std::string& name, const torch::Tensor& values) {
  const torch::Tensor dense = values.detach().contiguous();
  writer_.AddFloat32(name, {dense.sizes().begin(), dense.sizes().end()},
                     {dense.data_ptr<float>(), static_cast<std::size_t>(dense.numel())});
}

void CheckpointWriter::Add(const std::string& name, const wandr::TorchNetwork& network) {
  for (const auto& [part, tensor] : network.Tensors()) {
    writer_.AddFloat32(name + "." + part, tensor.shape, tensor.values);
  }
}

void CheckpointWriter::Write(const std::filesystem::path& path) {
  writer_.SetMetadata(texts_);
  writer_.Write(path);
}

CheckpointReader::CheckpointReader(const std::filesystem::path& path, const std::string& format,
                                   const std::string& options)
    : where_(path.string()), file_(path) {
  if (Text("format") != format) {
    throw Error(where_, fmt::format("is not a checkpoint of this training ({})", format),
                "Give a checkpoint.safetensors, or --force");
  }
  if (Text("options") != options) {
    throw Error(
        where_,
        fmt::format("was made with other options or data ({}), not {}", Text("options"), options),
        "Give the same options, or another --output, or --force to begin anew");
  }
}

std::string CheckpointReader::Text(const std::string& name) const {
  const auto found = file_.Metadata().find(name);
  return found == file_.Metadata().end() ? "" : found->second;
}

void CheckpointReader::Fill(const std::string& name, torch::Tensor& tensor) const {
  const std::vector<float> values = file_.Read(name).AsFloats();
  if (static_cast<std::int64_t>(values.size()) != tensor.numel()) {
    Damaged(fmt::format("{} has {} values, not {}", name, values.size(), tensor.numel()));
  }
  const torch::NoGradGuard no_gradients;
  std::copy(values.begin(), values.end(), tensor.data_ptr<float>());
}

void CheckpointReader::Fill(const std::string& name, wandr::TorchNetwork& network) const {
  network.ForEach(
      [&](const std::string& part, torch::Tensor& tensor) { Fill(name + "." + part, tensor); });
}

void CheckpointReader::Damaged(const std::string& problem) const {
  throw Error(where_, problem, "The file is damaged: begin anew with --force");
}

}  // namespace holdfast
