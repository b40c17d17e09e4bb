// What ProcessGroupGloo.hpp names of the library Gloo. PyTorch's wheels hold Gloo inside libtorch_cpu,
// without its headers; build.rs puts this file in their place.
//
// These are declarations for the compiler alone: nothing here is made, called or laid out by relight, so
// that they need not be complete. Written for libtorch 2.11, whose version make setup-train and
// torch-sys both check.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace gloo {

class Context {
 public:
  void setTimeout(std::chrono::milliseconds timeout);
};

namespace transport {
class Device;
class UnboundBuffer;
}  // namespace transport

namespace rendezvous {
class Store {
 public:
  virtual ~Store() = default;
  virtual void set(const std::string& key, const std::vector<char>& value) = 0;
  virtual std::vector<char> get(const std::string& key) = 0;
  virtual void wait(const std::vector<std::string>& keys) = 0;
  virtual void wait(const std::vector<std::string>& keys,
                    const std::chrono::milliseconds& timeout) = 0;
};
}  // namespace rendezvous

}  // namespace gloo
