#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "scan_source.h"

namespace alces::offline {

// One place for the next scan. The thread owns the source while `wanted` is set, the caller while it is not.
struct PrefetchingScanSource::Worker {
  explicit Worker(ScanSource& scan_source)
      : source(scan_source), thread([this](std::stop_token stop) { run(stop); }) {}

  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    while (changed.wait(lock, stop, [this] { return wanted.has_value(); })) {
      const std::size_t index = *wanted;
      lock.unlock();
      std::exception_ptr caught;
      try {
        is_there = source.read(index, scan);
      } catch (...) {
        caught = std::current_exception();
      }
      lock.lock();
      error = caught;
      ready = index;
      wanted.reset();
      changed.notify_all();
    }
  }

  ScanSource& source;
  std::mutex mutex;
  std::condition_variable_any changed;
  std::optional<std::size_t> wanted;
  std::optional<std::size_t> ready;
  ScanPoints scan;
  bool is_there = true;
  std::exception_ptr error;
  std::jthread thread;  // last: it uses all of the above
};

PrefetchingScanSource::PrefetchingScanSource(std::unique_ptr<ScanSource> source)
    : source_(std::move(source)), worker_(std::make_unique<Worker>(*source_)) {}

PrefetchingScanSource::~PrefetchingScanSource() = default;

bool PrefetchingScanSource::read(std::size_t index, ScanPoints& scan) {
  Worker& worker = *worker_;
  std::unique_lock lock(worker.mutex);
  worker.changed.wait(lock, [&] { return !worker.wanted.has_value(); });
  bool is_there = true;
  if (worker.ready == index) {
    worker.ready.reset();
    is_there = worker.is_there;
    if (worker.error) std::rethrow_exception(std::exchange(worker.error, nullptr));
    std::swap(scan, worker.scan);
  } else {
    is_there = source_->read(index, scan);
  }
  if (is_there && index + 1 < source_->size() && worker.ready != index + 1) {
    worker.wanted = index + 1;
    worker.changed.notify_all();
  }
  return is_there;
}

std::size_t PrefetchingScanSource::size() const {
  return source_->size();
}
std::string PrefetchingScanSource::name(std::size_t index) const {
  return source_->name(index);
}
std::size_t PrefetchingScanSource::number(std::size_t index) const {
  return source_->number(index);
}
std::optional<Pose> PrefetchingScanSource::odometry(std::size_t index) const {
  return source_->odometry(index);
}
std::optional<double> PrefetchingScanSource::stamp_s(std::size_t index) const {
  return source_->stamp_s(index);
}
std::uint64_t PrefetchingScanSource::file_bytes(std::size_t index) const {
  return source_->file_bytes(index);
}
std::string PrefetchingScanSource::description() const {
  return source_->description();
}
std::vector<std::string> PrefetchingScanSource::warnings() const {
  return source_->warnings();
}

}  // namespace alces::offline
