// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Work that several processes divide which run the same program in step, as ranks of MPI do: each
// has the same data and makes the same decisions, does its share of the dear part and gets from
// the others what they have done. What is not divided each does for itself.
//
// Like an interrupt check (interrupt.h) it belongs to the thread that runs the program, because
// every function between the program and the work would have to hand it on. Other threads do all of
// their work themselves.

#include <string>
#include <vector>

namespace tangible {

class SharedWork {
 public:
  SharedWork() = default;
  virtual ~SharedWork() = default;
  SharedWork(const SharedWork&) = delete;
  SharedWork& operator=(const SharedWork&) = delete;

  virtual int rank() const = 0;  ///< of this process, from 0
  virtual int size() const = 0;  ///< number of processes
  /// Bytes for all processes; those of all of them, by rank. Waits for the others, which have to
  /// call it as often.
  virtual std::vector<std::string> Exchange(const std::string& own) = 0;

  /// That of this thread; null: it divides nothing.
  static SharedWork* Current() { return Place(); }

  /// Sets it for this thread, as long as the scope lives.
  class Scope {
   public:
    explicit Scope(SharedWork* work) { Place() = work; }
    ~Scope() { Place() = nullptr; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
  };

 private:
  static SharedWork*& Place() {
    static thread_local SharedWork* work = nullptr;
    return work;
  }
};

}  // namespace tangible
