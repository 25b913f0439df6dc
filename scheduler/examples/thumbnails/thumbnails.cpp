// The graph: read -> decode -> shrink -> encode -> write, the first and the last of which wait for
// disks, not for cores.
#include "thumbnails.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "image.h"

namespace fs = std::filesystem;

namespace {

// An item is the number of a job: small, as items should be. What is large is here, and only while
// the job is in flight.
struct Job {
  fs::path from;
  fs::path to;
  Bytes bytes = {};  // of the image, later of the thumbnail
  Image image = {};
};

std::vector<Job> list_jobs(const ThumbnailOptions& options) {
  std::vector<Job> jobs;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(options.from)) {
    std::string suffix = entry.path().extension().string();
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (entry.is_regular_file() && (suffix == ".png" || suffix == ".jpg" || suffix == ".jpeg")) {
      const fs::path name = entry.path().lexically_relative(options.from);
      jobs.push_back({.from = entry.path(), .to = options.to / (name.string() + ".jpg")});
    }
  }
  return jobs;
}

bool is_up_to_date(const Job& job) {
  std::error_code none;  // of the two, or not to be looked at: to be made, or found bad
  std::error_code gone;
  const auto made = fs::last_write_time(job.to, none);
  const auto changed = fs::last_write_time(job.from, gone);
  return !none && !gone && made >= changed;
}

Bytes read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  Bytes bytes(in ? static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg())) : 0);
  in.seekg(0);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()))) {
    throw std::runtime_error("cannot be read");
  }
  return bytes;
}

// Under another name first: who sees the name sees the whole thumbnail.
void write_file(const fs::path& path, const Bytes& bytes) {
  fs::create_directories(path.parent_path());
  fs::path part = path;
  part += ".part";
  std::ofstream out(part, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) {
    throw fs::filesystem_error("cannot write", part, std::error_code(EIO, std::generic_category()));
  }
  fs::rename(part, path);
}

}  // namespace

ThumbnailSummary make_thumbnails(const ThumbnailOptions& options) {
  using Stage = carpool::StageHandle<std::uint32_t>;
  using Batch = carpool::Batch<std::uint32_t>;
  std::vector<Job> jobs = list_jobs(options);
  std::atomic<std::uint64_t> made{0}, up_to_date{0}, bad{0};
  std::mutex bad_mutex;

  // One image is a batch: it is much work.
  carpool::Graph graph;
  const auto stage = [&](const char* name, int rank, std::uint32_t threads) {
    return graph.add_stage<std::uint32_t>({.name = name,
                                           .block_items = 1,
                                           .rank = rank,
                                           .concurrency = threads,
                                           .blocking = threads != 0});
  };
  const Stage read = stage("read", 0, std::max(1U, options.readers));
  const Stage decode_stage = stage("decode", 1, 0);
  const Stage shrink_stage = stage("shrink", 2, 0);
  const Stage encode_stage = stage("encode", 3, 0);
  const Stage write = stage("write", 4, std::max(1U, options.readers / 2));

  // What one image's step may do; `next` gets the job if that says true. A bad image ends here.
  const auto add_step = [&](Stage from, const Stage* next, auto step) {
    graph.set_kernel(from, [&, next, step](const Batch& batch, carpool::Emitter& out) {
      Job& job = jobs[batch.items.front()];
      try {
        if (step(job) && next != nullptr) {
          out.emit(*next, 0, batch.items);
          return;
        }
      } catch (const fs::filesystem_error&) {
        throw;  // no thumbnail at all could be written
      } catch (const std::exception& error) {
        ++bad;
        const std::lock_guard guard(bad_mutex);
        if (options.on_bad) options.on_bad(job.from, error.what());
      }
      job.bytes = {};  // this job is over
      job.image = {};
    });
    if (next != nullptr) graph.add_edge(from, *next);
  };
  add_step(read, &decode_stage, [&](Job& job) {
    if (is_up_to_date(job)) {
      ++up_to_date;
      return false;
    }
    job.bytes = read_file(job.from);
    return true;
  });
  add_step(decode_stage, &shrink_stage, [](Job& job) {
    job.image = decode(job.bytes);
    job.bytes = {};
    return true;
  });
  add_step(shrink_stage, &encode_stage, [&](Job& job) {
    job.image = shrink(job.image, options.size);
    return true;
  });
  add_step(encode_stage, &write, [](Job& job) {
    job.bytes = encode(job.image);
    job.image = {};
    return true;
  });
  add_step(write, nullptr, [&](Job& job) {
    write_file(job.to, job.bytes);
    ++made;
    return false;
  });

  std::uint32_t next = 0;
  const auto files = graph.add_source(
      {.name = "files"}, [&](carpool::SourceContext& source, carpool::Emitter& out) {
        for (std::uint32_t i = 0; i < source.budget && next < jobs.size(); ++i) {
          out.emit(read, 0, next++);
        }
        return next < jobs.size() ? carpool::SourceStatus::more : carpool::SourceStatus::exhausted;
      });
  graph.add_edge(files, read);

  carpool::RunOptions run = options.run;
  run.in_flight = options.in_flight;  // one credit an image: that bounds the memory
  if (options.on_progress) {
    run.progress = [&](const carpool::Progress&) {
      options.on_progress(made + up_to_date + bad, jobs.size());
    };
  }
  ThumbnailSummary summary;
  summary.report = carpool::run(graph, run);
  summary.made = made;
  summary.up_to_date = up_to_date;
  summary.bad = bad;
  summary.left = jobs.size() - made - up_to_date - bad;
  return summary;
}
