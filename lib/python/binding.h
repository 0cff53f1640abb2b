// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What the parts of the compiled module share.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

#include "tangible/math/scalar.h"
#include "tangible/scene/scene.h"

namespace tangible::python {

namespace py = pybind11;

/// Becomes tangible.TangibleError, with the one line of the programs.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Lets Ctrl-C end a run: Check, called in each step, looks for signals every 50 ms in the thread
/// that has called from Python, and ends the runs of the others with it.
class SignalWatch {
 public:
  /// Thrown where a signal's handler has raised; the exception stands in the caller's thread.
  struct Raised {};

  void Check() {
    if (raised_) throw Raised();
    if (std::this_thread::get_id() != caller_ || ++calls_ % 32 != 0) return;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(50);
    CheckNow();
  }
  /// The same at once, in the thread that has called from Python.
  void CheckNow() {
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) {
      raised_ = true;
      throw Raised();
    }
  }

 private:
  std::thread::id caller_ = std::this_thread::get_id();
  std::atomic<bool> raised_{false};
  unsigned calls_ = 0;
  std::chrono::steady_clock::time_point next_ =
      std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
};

/// Runs `work(watch)` without the interpreter's lock.
template <typename Work>
auto WithoutLock(const Work& work) {
  SignalWatch watch;
  try {
    const py::gil_scoped_release release;
    return work(&watch);
  } catch (const SignalWatch::Raised&) {
    throw py::error_already_set();
  }
}

/// A copy of a matrix as an array of this shape.
inline Array ToArray(const RowMatrixXd& values, const std::vector<py::ssize_t>& shape) {
  Array array(shape);
  std::copy_n(values.data(), values.size(), array.mutable_data());
  return array;
}

inline Array ToArray(const std::vector<double>& values, const std::vector<py::ssize_t>& shape) {
  // The array owns the vector's memory: nothing is copied.
  auto* kept = new std::vector<double>(values);
  return Array(shape, kept->data(),
               py::capsule(kept, [](void* p) { delete static_cast<std::vector<double>*>(p); }));
}

void BindScene(py::module_* module);
void BindRollout(py::module_* module);
void BindFit(py::module_* module);

}  // namespace tangible::python
