#include "server/metrics_endpoint.h"

#include <prometheus/text_serializer.h>

#include <array>
#include <exception>
#include <utility>

#include "absl/strings/str_format.h"

namespace binpose::server {
namespace {

/// Answers GET with what a function makes.
class Page final : public CivetHandler {
 public:
  struct Content {
    bool ok = true;
    std::string text;
  };

  explicit Page(std::function<Content()> make) : make_(std::move(make)) {}

  bool handleGet(CivetServer* /*server*/, mg_connection* connection) override {
    const Content content = make_();
    const std::string head = absl::StrFormat(
        "HTTP/1.1 %s\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n"
        "Content-Length: %d\r\nConnection: close\r\n\r\n",
        content.ok ? "200 OK" : "503 Service Unavailable", content.text.size());
    mg_write(connection, head.data(), head.size());
    mg_write(connection, content.text.data(), content.text.size());
    return true;
  }

 private:
  std::function<Content()> make_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::start(const std::string& address,
                                                                        const Source& source) {
  // A half-open socket holds a thread until the time-out.
  const std::vector<std::string> options = {"listening_ports",    address, "num_threads", "8",
                                            "request_timeout_ms", "5000"};
  std::unique_ptr<MetricsEndpoint> endpoint(new MetricsEndpoint);
  try {
    endpoint->server_ = std::make_unique<CivetServer>(options);
  } catch (const std::exception& error) {
    return absl::UnavailableError(absl::StrFormat("Cannot serve metrics on %s: %s.", address, error.what()));
  }
  const auto add = [&endpoint](const char* path, std::function<Page::Content()> make) {
    endpoint->handlers_.push_back(std::make_unique<Page>(std::move(make)));
    endpoint->server_->addHandler(path, *endpoint->handlers_.back());
  };
  add("/metrics", [source] {
    source.before_scrape();
    return Page::Content{true, prometheus::TextSerializer().Serialize(source.registry->Collect())};
  });
  add("/healthz", [] { return Page::Content{true, "ok\n"}; });
  add("/readyz", [source] {
    const bool is_ready = source.is_ready();
    return Page::Content{is_ready, (is_ready ? "ready\n" : "not ready\n") + source.detail()};
  });
  return endpoint;
}

absl::Status probe(const std::string& address, const std::string& path) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  std::array<char, 256> fault{};
  mg_connection* connection = mg_download(host.c_str(), std::stoi(address.substr(colon + 1)), 0, fault.data(),
                                          fault.size(), "GET %s HTTP/1.0\r\n\r\n", path.c_str());
  if (connection == nullptr) {
    return absl::UnavailableError(absl::StrFormat("Nothing answers at http://%s%s: %s.", address, path, fault.data()));
  }
  const int code = mg_get_response_info(connection)->status_code;
  mg_close_connection(connection);
  if (code == 200) return absl::OkStatus();
  return absl::UnavailableError(absl::StrFormat("http://%s%s answers %d.", address, path, code));
}

}  // namespace binpose::server
