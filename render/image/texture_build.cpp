// See texture_build.h.
#include "render/image/texture_build.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <map>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "render/image/image_decode.h"
#include "render/image/mip_filter.h"

namespace carpool::render {
namespace {

using stages::Texture;

/// One chain of texels to be made, with all sources that show it.
struct Chain {
  TextureSourceView source;
  Texture texture;
  std::vector<size_t> users;
};

/// An image with the chains that are made of it.
struct ImageJob {
  int image = 0;
  ImageInfo info;
  std::vector<Chain> chains;
};

std::vector<ImageJob> CollectJobs(std::span<const EncodedImageView> images,
                                  std::span<const TextureSourceView> sources) {
  using Key = std::tuple<bool, bool>;
  std::map<int, std::map<Key, Chain>> by_image;
  for (size_t i = 0; i < sources.size(); ++i) {
    const TextureSourceView& source = sources[i];
    if (source.image < 0 || static_cast<size_t>(source.image) >= images.size()) {
      throw std::invalid_argument("BuildTextures: a source names an image that does not exist");
    }
    const bool weighted = source.srgb && source.alpha_weighted;
    Chain& chain = by_image[source.image][{source.srgb, weighted}];
    chain.source = {source.image, source.srgb, weighted};
    chain.users.push_back(i);
  }
  std::vector<ImageJob> jobs;
  for (auto& [image, chains] : by_image) {
    const EncodedImageView& encoded = images[static_cast<size_t>(image)];
    ImageJob& job = jobs.emplace_back();
    job.image = image;
    job.info = ReadImageInfo(encoded.bytes, encoded.where);
    for (auto& [key, chain] : chains) job.chains.push_back(std::move(chain));
  }
  return jobs;
}

/// Gives every level its place; returns the size of the pool.
int64_t LayOut(std::vector<ImageJob>& jobs, std::span<const EncodedImageView> images) {
  int64_t words = 0;
  for (ImageJob& job : jobs) {
    for (Chain& chain : job.chains) {
      Texture& texture = chain.texture;
      texture.width = job.info.width;
      texture.height = job.info.height;
      texture.format = job.info.format;
      texture.srgb = chain.source.srgb ? 1 : 0;
      texture.levels = MipLevels(texture.width, texture.height);
      for (int level = 0; level < texture.levels; ++level) {
        texture.level_offset[level] = static_cast<int32_t>(words);
        words += LevelWords(texture, level);
        if (words > std::numeric_limits<int32_t>::max()) {
          throw InputError(images[static_cast<size_t>(job.image)].where,
                           "with this image the scene's textures exceed 8 GiB; make some smaller");
        }
      }
    }
  }
  return words;
}

void FillChains(const ImageJob& job, const EncodedImageView& encoded, std::span<uint32_t> words,
                const WarningSink& warn) {
  const auto level0 = [&](const Chain& chain) {
    return words.subspan(static_cast<size_t>(chain.texture.level_offset[0]),
                         static_cast<size_t>(job.info.Words()));
  };
  const Chain& first = job.chains.front();
  DecodeImage(encoded.bytes, encoded.where, job.info, level0(first), warn);
  for (const Chain& chain : job.chains) {
    if (&chain != &first) std::ranges::copy(level0(first), level0(chain).begin());
  }
  for (const Chain& chain : job.chains) {
    FillMipLevels(chain.texture, chain.source.alpha_weighted, words);
  }
}

}  // namespace

void BuildTextures(std::span<const EncodedImageView> images,
                   std::span<const TextureSourceView> sources, stages::TextureTables& out,
                   const WarningSink& warn) {
  std::vector<ImageJob> jobs = CollectJobs(images, sources);
  out.words.resize(static_cast<size_t>(LayOut(jobs, images)));
  // The error of the first bad image, not of the first that happened to be decoded.
  std::vector<std::exception_ptr> errors(jobs.size());
  tbb::parallel_for(size_t{0}, jobs.size(), [&](size_t i) {
    try {
      FillChains(jobs[i], images[static_cast<size_t>(jobs[i].image)], out.words, warn);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  });
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
  out.textures.assign(sources.size(), Texture{});
  for (const ImageJob& job : jobs) {
    for (const Chain& chain : job.chains) {
      for (const size_t user : chain.users) out.textures[user] = chain.texture;
    }
  }
}

}  // namespace carpool::render
