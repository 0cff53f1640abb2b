// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What the parts of the compiled module share.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "tangible/math/interrupt.h"
#include "tangible/math/scalar.h"
#include "tangible/scene/scene.h"

namespace tangible::python {

namespace py = pybind11;

/// Becomes tangible.TangibleError, with the one line of the programs.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Lets Ctrl-C end a computation: Check, called in each step, looks for signals every 50 ms in the
/// thread that has called from Python, and ends the runs of the others with it.
class SignalWatch {
 public:
  /// Thrown where a signal's handler has raised; the exception stands in the caller's thread.
  struct Raised {};

  void Check() {
    if (raised_) throw Raised();
    if (std::this_thread::get_id() != caller_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + kBetweenSignals;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) {
      raised_ = true;
      throw Raised();
    }
  }

 private:
  static constexpr std::chrono::milliseconds kBetweenSignals{50};
  std::thread::id caller_ = std::this_thread::get_id();
  std::atomic<bool> raised_{false};
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + kBetweenSignals;
};

/// Runs `work()` without the interpreter's lock; a signal ends it (interrupt.h).
template <typename Work>
auto WithoutLock(const Work& work) {
  SignalWatch watch;
  const std::function<void()> check = [&watch] { watch.Check(); };
  try {
    const py::gil_scoped_release release;
    const InterruptScope scope(&check);
    return work();
  } catch (const SignalWatch::Raised&) {
    throw py::error_already_set();
  }
}

/// Lets calls that share memory take turns. Called without the interpreter's lock; whoever waits
/// looks for signals.
class Turns {
 public:
  template <typename Work>
  auto Take(const Work& work) {
    constexpr std::chrono::milliseconds kBetweenChecks(20);
    // A signal's handler may call what the signal has interrupted: it would wait for itself.
    if (holder_ == std::this_thread::get_id()) {
      throw Error("called by a signal's handler while a call of the same object runs");
    }
    std::unique_lock<std::timed_mutex> lock(mutex_, std::defer_lock);
    while (!lock.try_lock_for(kBetweenChecks)) CheckInterrupt();
    const Holder holder(&holder_);
    return work();
  }

 private:
  class Holder {
   public:
    explicit Holder(std::atomic<std::thread::id>* id) : id_(id) {
      *id_ = std::this_thread::get_id();
    }
    ~Holder() { *id_ = std::thread::id(); }
    Holder(const Holder&) = delete;
    Holder& operator=(const Holder&) = delete;

   private:
    std::atomic<std::thread::id>* id_;
  };

  std::timed_mutex mutex_;
  std::atomic<std::thread::id> holder_{};
};

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
void BindControl(py::module_* module);
void BindSimulate(py::module_* module);
void BindSimulation(py::module_* module);

}  // namespace tangible::python
