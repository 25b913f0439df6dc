// A switch that ends a run early, from any thread or from a signal handler.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>

namespace carpool {

/// CancelToken asks a run to stop. Copies share one switch, so keep one and pass a copy to run().
///
///     carpool::CancelToken token;
///     std::thread watcher([token] { wait_for_key(); token.cancel(); });
///     carpool::run(graph, {.cancel = token});   // report.outcome tells
///
/// Thread safety: every method may be called at any time from any thread; cancel() and drain() also
/// from a signal handler, because they only store to a lock-free atomic.
class CancelToken {
 public:
  CancelToken() : state_(std::make_shared<std::atomic<int>>(kRunning)) {}

  /// A token made from nullptr can never ask for anything. It is the default of RunOptions.
  explicit CancelToken(std::nullptr_t) {}

  /// cancel ends the run within one batch per worker; items in flight are dropped.
  void cancel() const { raise_to(kCancelled); }

  /// drain stops the sources and lets what is in flight come to its end.
  void drain() const { raise_to(kDraining); }

  bool cancelled() const { return load() == kCancelled; }
  bool draining() const { return load() != kRunning; }

 private:
  static constexpr int kRunning = 0;
  static constexpr int kDraining = 1;
  static constexpr int kCancelled = 2;

  // Relaxed: the token carries no data; whoever needs to see more has run()'s return to synchronise
  // with.
  int load() const { return state_ ? state_->load(std::memory_order_relaxed) : kRunning; }
  void raise_to(int wanted) const {
    int seen = load();
    while (state_ && seen < wanted &&
           !state_->compare_exchange_weak(seen, wanted, std::memory_order_relaxed)) {
    }
  }

  std::shared_ptr<std::atomic<int>> state_;
};

}  // namespace carpool
