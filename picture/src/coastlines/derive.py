import json, struct, math
t = json.load(open('package/land-50m.json'))
s, o = t['transform']['scale'], t['transform']['translate']
lines = []
for arc in t['arcs']:
    x = y = 0; pts = []
    for dx, dy in arc:
        x += dx; y += dy
        pts.append((x*s[0]+o[0], y*s[1]+o[1]))
    lines.append(pts)
print(len(lines), sum(map(len, lines)))
def cart(p):
    l, b = math.radians(p[0]), math.radians(p[1]); return (math.cos(b)*math.cos(l), math.cos(b)*math.sin(l), math.sin(b))
def cross(a,b): return (a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0])
def dist(a,b): return math.dist(a,b)
def dseg(p,a,b):
    d=[b[i]-a[i] for i in range(3)]; n=sum(v*v for v in d)
    u=0 if n==0 else max(0,min(1,sum((p[i]-a[i])*d[i] for i in range(3))/n))
    return math.dist(p,[a[i]+u*d[i] for i in range(3)])
def simplify(pts, tol):
    c=[cart(p) for p in pts]; keep={0,len(pts)-1}; st=[(0,len(pts)-1)]
    while st:
        i,j=st.pop()
        if j-i<2: continue
        k=max(range(i+1,j),key=lambda k:dseg(c[k],c[i],c[j]))
        if dseg(c[k],c[i],c[j])>tol: keep.add(k); st+=[(i,k),(k,j)]
    return [pts[i] for i in sorted(keep)]
# Edges along the cut at 180 degrees and to the pole belong to the polygons, not to the coast.
art=lambda a,b: (abs(abs(a[0])-180)<0.02 and abs(abs(b[0])-180)<0.02) or (a[1]<-89.5 or b[1]<-89.5)
out=[]
for pts in lines:
    run=[pts[0]]
    for a,b in zip(pts,pts[1:]):
        if art(a,b):
            if len(run)>1: out.append(run)
            run=[b]
        else: run.append(b)
    if len(run)>1: out.append(run)
tol=math.radians(0.05)
res=[]
for r in out:
    if max(dist(cart(p),cart(r[0])) for p in r) < math.radians(0.25): continue   # tiny islands
    q=simplify(r,tol)
    if len(q)==2 and q[0]==q[1]: continue
    res.append(q)
res.sort(key=len, reverse=True)
n=sum(map(len,res)); print(len(res), n, 4*n)
b=bytearray()
for r in res:
    b+=struct.pack('<H',len(r))
    for x,y in r: b+=struct.pack('<hh',round(x*100),round(y*100))
open('coastlines.bin','wb').write(b); print(len(b))
