// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "geometry/io/pickle/pickle_context.h"

namespace holdfast {

/// How torch writes tensors into pickles: as views (offset, size, stride) of storages, whose
/// numbers lie elsewhere. Several tensors may be views of one storage.
class PickleTorch {
 public:
  explicit PickleTorch(PickleContext& context) : context_(context) {}

  using Arguments = std::vector<NodeIndex>;

  /// ('storage', class, key, device, count)
  NodeIndex Storage(NodeIndex persistent_id);
  /// What torch.storage._load_from_bytes(file) gives.
  NodeIndex StorageFromBytes(const Arguments& arguments);
  /// _rebuild_tensor(storage, offset, size, stride, ...)
  NodeIndex Tensor(const Arguments& arguments);
  /// The same; the type of its elements is the seventh argument.
  NodeIndex UntypedTensor(const Arguments& arguments);

  /// After the pickle's end: asks for the storages and lays the tensors onto them.
  void Bind();

 private:
  struct Source {
    TorchStorageRequest request;
    DataBytes bytes;  ///< of a nested file; empty for those that are asked for
    bool is_nested = false;
  };
  struct View {
    NodeIndex node;
    std::size_t source;
    std::size_t offset;  ///< elements
  };

  NodeIndex AddSource(Source source, std::string class_name);
  NodeIndex AddView(const Arguments& arguments, const ElementType* element);
  void Lay(const View& view, const DataBytes& bytes);

  PickleContext& context_;
  std::vector<Source> sources_;
  std::unordered_map<NodeIndex, std::size_t> source_of_;
  std::map<std::string, NodeIndex, std::less<>> known_;
  std::vector<View> views_;
};

/// "f4" as an element; kind 'c' for complex numbers, which no array can have.
ElementType ElementFromCode(std::string_view code);

}  // namespace holdfast
