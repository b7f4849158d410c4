// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/pickle_globals.h"

#include <algorithm>
#include <string>
#include <utility>

// The names that a pickle may use. To allow another class whose instances are plain data, add a row
// with kInstance: its fields become names of a DataValue. No row executes anything.

namespace holdfast {
namespace {

using enum GlobalRole;

constexpr AllowedGlobal kAllowed[] = {
    // Python's own containers. Protocols before 4 call sets by name.
    {"builtins", "list", kList},
    {"builtins", "tuple", kList},
    {"builtins", "set", kList},
    {"builtins", "frozenset", kList},
    {"builtins", "dict", kDict},
    {"builtins", "bytes", kBytes},
    {"builtins", "bytearray", kBytes},
    {"builtins", "object", kInstance},
    {"builtins", "slice", kInstance},
    {"builtins", "range", kInstance},
    {"builtins", "xrange", kInstance},
    {"builtins", "complex", kComplex},
    // Factories of a defaultdict.
    {"builtins", "int", kClassOnly},
    {"builtins", "long", kClassOnly},
    {"builtins", "float", kClassOnly},
    {"builtins", "bool", kClassOnly},
    {"builtins", "str", kClassOnly},
    {"builtins", "unicode", kClassOnly},
    {"collections", "OrderedDict", kDict},
    {"collections", "defaultdict", kDict},
    {"collections", "Counter", kDict},
    {"collections", "deque", kList},
    {"copyreg", "_reconstructor", kReconstructor},
    {"copyreg", "__newobj__", kNewObject},
    {"_codecs", "encode", kLatin1},
    // Settings that fitting codes store with their results.
    {"argparse", "Namespace", kInstance},
    {"types", "SimpleNamespace", kInstance},
    {"easydict", "EasyDict", kDict},
    {"yacs.config", "CfgNode", kDict},
    {"pathlib", "PosixPath", kPath},
    {"pathlib", "PurePosixPath", kPath},
    {"pathlib", "WindowsPath", kPath},
    {"pathlib", "PureWindowsPath", kPath},
    {"datetime", "datetime", kInstance},
    {"datetime", "date", kInstance},
    {"datetime", "timedelta", kInstance},

    // numpy
    {"numpy", "ndarray", kNdarray},
    {"numpy", "matrix", kNdarray},
    {"numpy", "memmap", kNdarray},
    {"numpy.matrixlib.defmatrix", "matrix", kNdarray},
    {"numpy.core.defmatrix", "matrix", kNdarray},
    {"numpy.core.memmap", "memmap", kNdarray},
    {"numpy.core.multiarray", "_reconstruct", kReconstruct},
    {"numpy.core.multiarray", "scalar", kScalar},
    {"numpy.core.numeric", "_frombuffer", kFromBuffer},
    {"numpy", "dtype", kDtype},
    {"numpy", "bool", kClassOnly, "b1"},
    {"numpy", "bool_", kClassOnly, "b1"},
    {"numpy", "int8", kClassOnly, "i1"},
    {"numpy", "int16", kClassOnly, "i2"},
    {"numpy", "int32", kClassOnly, "i4"},
    {"numpy", "int64", kClassOnly, "i8"},
    {"numpy", "uint8", kClassOnly, "u1"},
    {"numpy", "uint16", kClassOnly, "u2"},
    {"numpy", "uint32", kClassOnly, "u4"},
    {"numpy", "uint64", kClassOnly, "u8"},
    {"numpy", "float16", kClassOnly, "f2"},
    {"numpy", "float32", kClassOnly, "f4"},
    {"numpy", "float64", kClassOnly, "f8"},
    {"numpy", "object_", kClassOnly, "O8"},

    // joblib: its fields describe the array whose bytes follow (PickleMachine)
    {"joblib.numpy_pickle", "NumpyArrayWrapper", kJoblibArray},

    // scipy.sparse
    {"scipy.sparse.csc", "csc_matrix", kInstance},
    {"scipy.sparse.csc", "csc_array", kInstance},
    {"scipy.sparse.csr", "csr_matrix", kInstance},
    {"scipy.sparse.csr", "csr_array", kInstance},
    {"scipy.sparse.coo", "coo_matrix", kInstance},
    {"scipy.sparse.coo", "coo_array", kInstance},
    {"scipy.sparse.arrays", "csc_array", kInstance},
    {"scipy.sparse.arrays", "csr_array", kInstance},
    {"scipy.sparse.arrays", "coo_array", kInstance},

    // chumpy, used by the first SMPL and MANO models (see data_numbers.cpp)
    {"chumpy.ch", "Ch", kInstance},
    {"chumpy", "Ch", kInstance},
    {"chumpy.reordering", "Select", kInstance},
    {"chumpy.reordering", "Reshape", kInstance},
    {"chumpy.reordering", "transpose", kInstance},
    {"chumpy.reordering", "Concatenate", kInstance},
    {"chumpy.ch", "MatVecMult", kInstance},
    {"chumpy.ch_ops", "add", kInstance},
    {"chumpy.ch_ops", "subtract", kInstance},
    {"chumpy.ch_ops", "multiply", kInstance},

    // torch
    {"torch._utils", "_rebuild_tensor", kTorchTensor},
    {"torch._utils", "_rebuild_tensor_v2", kTorchTensor},
    {"torch._utils", "_rebuild_tensor_v3", kTorchTensor3},
    {"torch._utils", "_rebuild_parameter", kTorchParameter},
    {"torch._utils", "_rebuild_parameter_with_state", kTorchParameter},
    {"torch._tensor", "_rebuild_from_type_v2", kTorchFromType},
    {"torch.storage", "_load_from_bytes", kTorchFromBytes},
    {"torch", "Size", kList},
    {"torch", "device", kInstance},
    {"torch", "Tensor", kClassOnly},
    {"torch._tensor", "Tensor", kClassOnly},
    {"torch.nn.parameter", "Parameter", kClassOnly},
    {"torch", "DoubleStorage", kTorchStorage, "f8"},
    {"torch", "FloatStorage", kTorchStorage, "f4"},
    {"torch", "HalfStorage", kTorchStorage, "f2"},
    {"torch", "BFloat16Storage", kTorchStorage, "B2"},
    {"torch", "LongStorage", kTorchStorage, "i8"},
    {"torch", "IntStorage", kTorchStorage, "i4"},
    {"torch", "ShortStorage", kTorchStorage, "i2"},
    {"torch", "CharStorage", kTorchStorage, "i1"},
    {"torch", "ByteStorage", kTorchStorage, "u1"},
    {"torch", "BoolStorage", kTorchStorage, "b1"},
    {"torch", "ComplexFloatStorage", kTorchStorage, "c8"},
    {"torch", "ComplexDoubleStorage", kTorchStorage, "c16"},
    {"torch", "UntypedStorage", kTorchStorage, "u1"},
    {"torch.storage", "UntypedStorage", kTorchStorage, "u1"},
    {"torch", "float64", kClassOnly, "f8"},
    {"torch", "float32", kClassOnly, "f4"},
    {"torch", "float16", kClassOnly, "f2"},
    {"torch", "bfloat16", kClassOnly, "B2"},
    {"torch", "int64", kClassOnly, "i8"},
    {"torch", "int32", kClassOnly, "i4"},
    {"torch", "int16", kClassOnly, "i2"},
    {"torch", "int8", kClassOnly, "i1"},
    {"torch", "uint64", kClassOnly, "u8"},
    {"torch", "uint32", kClassOnly, "u4"},
    {"torch", "uint16", kClassOnly, "u2"},
    {"torch", "uint8", kClassOnly, "u1"},
    {"torch", "bool", kClassOnly, "b1"},
};

// Names now, and in the table.
using Rename = std::pair<std::string_view, std::string_view>;

constexpr Rename kModules[] = {
    {"__builtin__", "builtins"},
    {"copy_reg", "copyreg"},
    {"codecs", "_codecs"},
    {"pathlib._local", "pathlib"},
};

constexpr Rename kBeginnings[] = {
    {"numpy._core.", "numpy.core."},
    {"scipy.sparse._", "scipy.sparse."},
};

std::string Canonical(std::string_view module) {
  for (const auto& [now, then] : kModules) {
    if (module == now) return std::string(then);
  }
  for (const auto& [now, then] : kBeginnings) {
    if (module.starts_with(now)) return std::string(then).append(module.substr(now.size()));
  }
  return std::string(module);
}

}  // namespace

const AllowedGlobal* FindAllowedGlobal(std::string_view module, std::string_view name) {
  constexpr std::size_t kLongest = 64;
  if (module.size() > kLongest || name.size() > kLongest) return nullptr;
  const std::string plain = Canonical(module);
  const auto* row = std::find_if(std::begin(kAllowed), std::end(kAllowed), [&](const auto& r) {
    return r.module == plain && r.name == name;
  });
  return row == std::end(kAllowed) ? nullptr : row;
}

}  // namespace holdfast
