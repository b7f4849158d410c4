// SPDX-License-Identifier: MIT
#include "geometry/io/container/safetensors.h"

#include "geometry/error.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using holdfast::fuzz::Require;

// All tensors whose type is read, by name.
std::map<std::string, holdfast::NpyArray> ReadAll(const holdfast::SafetensorsReader& reader) {
  std::map<std::string, holdfast::NpyArray> arrays;
  for (const std::string& name : reader.Names()) {
    if (name.empty()) continue;  // read, but no name that we would write
    try {
      arrays[name] = reader.Read(name).array;
    } catch (const holdfast::Error&) {
      continue;
    }
  }
  return arrays;
}

}  // namespace

HOLDFAST_FUZZ_TARGET(safetensors) {
  const holdfast::SafetensorsReader reader(
      holdfast::ByteSource(trial.Bytes(), "tensors.safetensors"));
  const auto arrays = ReadAll(reader);
  trial.Accept();
  holdfast::SafetensorsWriter writer;
  for (const auto& [name, array] : arrays) {
    Require(array.data.size() == array.NumElements() * array.item_size,
            "a tensor holds as many bytes as its shape says");
    writer.Add(name, array);
  }
  if (!reader.Metadata().empty()) writer.SetMetadata(reader.Metadata());

  const holdfast::fuzz::ScratchFile file(".safetensors");
  writer.Write(file.Path());
  const holdfast::SafetensorsReader again(file.Path());
  Require(again.Metadata() == reader.Metadata(), "metadata come back the same");
  const auto arrays_again = ReadAll(again);
  Require(arrays_again.size() == arrays.size(), "all tensors come back");
  for (const auto& [name, array] : arrays) {
    const auto found = arrays_again.find(name);
    Require(found != arrays_again.end() && found->second.data == array.data &&
                found->second.shape == array.shape && found->second.kind == array.kind,
            "a tensor comes back the same");
  }
}
