# docker build -t binpose .                       the server
# docker build -t binpose-cli --target cli .      the command
# Run it as deploy/compose.yaml does: read-only, without privileges, with a volume for the models.
FROM debian:bookworm-slim AS build
WORKDIR /src
COPY deploy/install-packages.sh deploy/
RUN deploy/install-packages.sh build
COPY . .
RUN cmake --preset release && cmake --build --preset release \
  && strip build/release/bin/binpose build/release/bin/binpose-server

FROM debian:bookworm-slim AS runtime
COPY deploy/install-packages.sh /tmp/
RUN /tmp/install-packages.sh run && rm -rf /tmp/install-packages.sh /var/lib/apt/lists/* /var/cache/apt/* \
  && useradd --system --no-create-home --uid 10001 binpose && install -d -o binpose /models
# For whoever looks into a container, too.
COPY --from=build /src/build/release/bin/binpose /usr/local/bin/
LABEL org.opencontainers.image.title="binpose" \
  org.opencontainers.image.description="Finds known parts in point clouds" \
  org.opencontainers.image.licenses="Apache-2.0"
USER binpose

FROM runtime AS cli
ENTRYPOINT ["binpose"]

FROM runtime AS server
COPY --from=build /src/build/release/bin/binpose-server /usr/local/bin/
VOLUME /models
EXPOSE 50051 9464
STOPSIGNAL SIGTERM
# The health check reads the same variables. A container's network is closed unless its ports are published: publish to
# loopback, or mount a certificate and say BINPOSE_TLS_CERT and BINPOSE_TLS_KEY.
ENV BINPOSE_LISTEN=0.0.0.0:50051 BINPOSE_METRICS=0.0.0.0:9464 BINPOSE_MODEL_DIR=/models BINPOSE_INSECURE=true
HEALTHCHECK --interval=10s --timeout=3s --start-period=60s CMD ["binpose-server", "--healthcheck"]
ENTRYPOINT ["binpose-server"]
