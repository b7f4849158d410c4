// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "geometry/io/pickle/pickle_globals.h"

namespace holdfast {

/// Dtypes, arrays and scalars as numpy's versions 1 and 2 write them into pickles.
class PickleNumpy {
 public:
  explicit PickleNumpy(PickleContext& context) : context_(context) {}

  using Arguments = std::vector<NodeIndex>;

  /// numpy.dtype("f8", align, copy); its state gives the byte order.
  NodeIndex Dtype(const Arguments& arguments);
  bool IsDtype(NodeIndex index) const { return dtypes_.contains(index); }
  /// (version, byte order, subdtype, names, fields, item size, ...)
  void SetDtypeState(NodeIndex dtype, NodeIndex state);

  /// An array whose state follows.
  NodeIndex EmptyArray();
  bool IsEmptyArray(NodeIndex index) const;
  /// (version, shape, dtype, is Fortran order, bytes or list). The node becomes the array; an array
  /// of Python objects becomes a list, nested for several dimensions.
  void SetArrayState(NodeIndex array, NodeIndex state);

  /// Whether a list was an array of objects without dimensions.
  bool IsObjectScalar(NodeIndex list) const { return object_scalars_.contains(list); }

  /// scalar(dtype, bytes): an array without dimensions.
  NodeIndex Scalar(const Arguments& arguments);
  /// _frombuffer(bytes, dtype, shape, order)
  NodeIndex FromBuffer(const Arguments& arguments);

  /// Whether this is an instance of joblib's NumpyArrayWrapper, whose array follows its state.
  bool IsJoblibArray(NodeIndex index) const;
  /// The array of an instance whose state was just set: a count of padding bytes and these (in
  /// newer versions), then the numbers.
  NodeIndex JoblibArray(NodeIndex instance, PickleScanner& scanner);

 private:
  struct Layout {
    ElementType element;
    std::string refused;  ///< why arrays of it cannot be read; empty if they can
  };

  Layout ParseDtype(std::string_view text) const;
  const ElementType& ElementAt(NodeIndex dtype) const;
  DataNode MakeArray(NodeIndex dtype, std::vector<std::size_t> shape, bool fortran_order,
                     NodeIndex bytes) const;
  DataNode NestObjects(const std::vector<NodeIndex>& items, const std::vector<std::size_t>& shape);

  PickleContext& context_;
  std::unordered_map<NodeIndex, Layout> dtypes_;
  std::unordered_set<NodeIndex> object_scalars_;
};

/// Tensors as torch writes them into pickles: as views (offset, size, stride) of storages, whose
/// numbers are stored elsewhere. Several tensors may be views of one storage.
class PickleTorch {
 public:
  explicit PickleTorch(PickleContext& context) : context_(context) {}

  using Arguments = std::vector<NodeIndex>;

  /// ('storage', class, key, device, count)
  NodeIndex Storage(NodeIndex persistent_id);
  /// The result of torch.storage._load_from_bytes(file).
  NodeIndex StorageFromBytes(const Arguments& arguments);
  /// _rebuild_tensor(storage, offset, size, stride, ...)
  NodeIndex Tensor(const Arguments& arguments);
  /// Same; the element type is the seventh argument.
  NodeIndex UntypedTensor(const Arguments& arguments);

  /// To be called after the pickle's end: requests the storages and binds the tensors to them.
  void Bind();

 private:
  struct Source {
    TorchStorageRequest request;
    DataBytes bytes;  ///< of a nested file; empty for requested storages
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

/// Element type of a code such as "f4"; kind 'c' for complex numbers, which no array can have.
ElementType ElementFromCode(std::string_view code);

}  // namespace holdfast
