// The one way to c10d, libtorch's library of collective operations, from Rust: tch does not bind it.
//
// A group is a TCPStore, through which its processes find each other, and Gloo, which sums tensors of
// the main memory over them. Called by src/distributed/process_group.rs and by nothing else; compiled by
// build.rs with the feature `libtorch`.
//
// Each function that can fail answers 0, or 1 with the reason in `fault` (`room` bytes, ended by a 0).
// No exception leaves this file. A group is used by one thread at a time.

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <ATen/ATen.h>
#include <torch/csrc/distributed/c10d/PrefixStore.hpp>
#include <torch/csrc/distributed/c10d/ProcessGroupGloo.hpp>
#include <torch/csrc/distributed/c10d/TCPStore.hpp>

struct relight_group {
  c10::intrusive_ptr<c10d::Backend> gloo;
};

namespace {

int told(const std::string& reason, char* fault, size_t room) {
  std::snprintf(fault, room, "%s", reason.c_str());
  return 1;
}

template <typename Work>
int guarded(char* fault, size_t room, Work work) {
  try {
    work();
    return 0;
  } catch (const c10::Error& error) {
    return told(error.what_without_backtrace(), fault, room);
  } catch (const std::exception& error) {
    return told(error.what(), fault, room);
  } catch (...) {
    return told("c10d failed without a reason", fault, room);
  }
}

}  // namespace

extern "C" {

// Waits until all `size` processes have joined, at most `join_ms` until they are at the store, which is
// at `host`:`port`. Where `hosted` is 0, process 0 opens it; else another program, the launcher, has.
// Groups of one store are told apart by `prefix`. A sum later waits at most `patience_ms` for the others.
int relight_group_join(const char* host, uint16_t port, int hosted, const char* prefix, int rank,
                       int size, int64_t join_ms, int64_t patience_ms, relight_group** group,
                       char* fault, size_t room) {
  return guarded(fault, room, [&] {
    c10d::TCPStoreOptions options;
    options.port = port;
    options.timeout = std::chrono::milliseconds(join_ms);
    if (hosted == 0) {
      options.isServer = rank == 0;
      options.numWorkers = static_cast<size_t>(size);
    }
    auto store = c10::make_intrusive<c10d::TCPStore>(host, options);
    auto own = c10::make_intrusive<c10d::PrefixStore>(prefix, store);
    auto gloo = c10d::ProcessGroupGloo::Options::create_default(
        std::chrono::milliseconds(patience_ms));
    auto joined = c10::make_intrusive<c10d::ProcessGroupGloo>(own, rank, size, gloo);
    *group = new relight_group{joined};
  });
}

// Replaces a dense tensor of the main memory by its sum over all processes. `tensor` is tch's, a
// pointer to an at::Tensor.
int relight_group_sum(relight_group* group, at::Tensor* tensor, char* fault, size_t room) {
  return guarded(fault, room, [&] {
    at::NoGradGuard without_gradient;
    std::vector<at::Tensor> tensors{*tensor};
    group->gloo->allreduce(tensors)->wait();
  });
}

// Closes the connections. Not to be called after a sum has failed: operations may still be under way.
void relight_group_leave(relight_group* group) {
  try {
    delete group;
  } catch (...) {
    // The connections are gone either way.
  }
}

}  // extern "C"
