# `alloc serve --http` in a container, with torch for the CPU alone:
#
#     docker build -t alloc .
#     docker run --rm -p 127.0.0.1:8080:8080 alloc
FROM python:3.12-slim AS build
ENV NUMBA_CACHE_DIR=/opt/numba
WORKDIR /build
COPY . .
RUN python -m venv /opt/alloc \
    && /opt/alloc/bin/pip install --no-cache-dir --extra-index-url https://download.pytorch.org/whl/cpu \
        'torch>=2.6,<2.14' '.[serve]' \
    && /opt/alloc/bin/alloc methods --prepare

FROM python:3.12-slim
RUN useradd --create-home --uid 10001 alloc
COPY --from=build /opt/alloc /opt/alloc
# numba takes machine code from folders alone in which it may write
COPY --from=build --chown=alloc /opt/numba /opt/numba
USER alloc
WORKDIR /home/alloc
ENV PATH=/opt/alloc/bin:$PATH OMP_NUM_THREADS=1 NUMBA_CACHE_DIR=/opt/numba
EXPOSE 8080
HEALTHCHECK --interval=10s --timeout=3s --start-period=60s \
    CMD ["python", "-c", "from urllib.request import urlopen; urlopen('http://127.0.0.1:8080/health', timeout=2)"]
STOPSIGNAL SIGTERM
ENTRYPOINT ["alloc"]
CMD ["serve", "--http", "0.0.0.0:8080", "--load", "gappo,local-search,greedy"]
