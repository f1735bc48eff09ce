# docker build -t binpose . && docker run -p 50051:50051 -v binpose-models:/models binpose
FROM debian:bookworm-slim AS build
WORKDIR /src
COPY deploy/install-packages.sh deploy/
RUN deploy/install-packages.sh build
COPY . .
RUN cmake --preset release && cmake --build --preset release

FROM debian:bookworm-slim
COPY deploy/install-packages.sh /tmp/
RUN /tmp/install-packages.sh run && rm -rf /tmp/install-packages.sh /var/lib/apt/lists/* \
  && useradd --system --no-create-home binpose && install -d -o binpose /models
COPY --from=build /src/build/release/bin/binpose-server /src/build/release/bin/binpose /usr/local/bin/
USER binpose
VOLUME /models
EXPOSE 50051 9464
STOPSIGNAL SIGTERM
# A container's network is closed unless its ports are published: publish to loopback, or mount --tls-cert and --tls-key.
ENTRYPOINT ["binpose-server", "--listen", "0.0.0.0:50051", "--insecure", "--metrics", "0.0.0.0:9464", "--model-dir", "/models"]
