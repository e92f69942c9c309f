// Asks a service for a picture of a dataset: picture ENDPOINT DATASET FILE.png
#include <slabstream/client.h>

#include <chrono>
#include <iostream>

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: picture ENDPOINT DATASET FILE.png\n";
    return 2;
  }
  try {
    slabstream::Service service = slabstream::Service::Connect({argv[1]});
    const slabstream::Image image = service.Render(argv[2], {{"azimuth", "30"}, {"size", "256x256"}});
    image.Save(argv[3]);
    const auto latency = std::chrono::duration_cast<std::chrono::milliseconds>(image.latency());
    std::cout << "rendered " << argv[3] << " in " << latency.count() << " ms\n";
    return 0;
  } catch (const slabstream::Error& error) {
    std::cerr << "picture: " << error.what() << '\n';
    return 1;
  }
}
